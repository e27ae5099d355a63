"""Which of many cases of a test are tried by day; the others are tried at night."""

from collections.abc import Iterable
from typing import Any

import pytest


def some_by_day(cases: Iterable[Any], every: int = 3) -> list[Any]:
    """Return cases for `parametrize`: one of so many, the first among them, by day."""
    return [each if number % every == 0 else _at_night(each) for number, each in enumerate(cases)]


def _at_night(case: Any) -> Any:
    values = case if isinstance(case, tuple) else (case,)
    return pytest.param(*values, marks=pytest.mark.slow)
