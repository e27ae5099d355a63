"""What reports and ``verify`` make again is made once in a process of the suite, per content.

A hundred tests damage one file each of the same run, and every one derives the run, fits its
readings, searches them for mistakes and draws its figures again: seconds from the same bytes.
Keys are the bytes, so that whatever a test has changed is made anew.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import joblib
import pytest

from elastocal.codec import splits
from elastocal.identification import calibration
from elastocal.procedure import RunFolder
from elastocal.report.pages import templating
from elastocal.verdict import chain, gather
from support.kept import content_hash


def remember(patch: pytest.MonkeyPatch) -> None:
    """Let derivations, fits, mistakes and figures be remembered until the patch is undone."""
    patch.setattr(chain, "derive_run", _remembered(chain.derive_run, _run_key))
    patch.setattr(
        gather, "reproduce_calibration", _remembered(gather.reproduce_calibration, joblib.hash)
    )
    find_mistakes = _remembered(calibration.find_mistakes, joblib.hash)
    for module in (calibration, splits):
        patch.setattr(module, "find_mistakes", find_mistakes)
    patch.setattr(templating, "themed_svg", _remembered(templating.themed_svg, _figure_key))


def _remembered(make: Callable[..., Any], key: Callable[[Any], str]) -> Callable[..., Any]:
    found: dict[str, Any] = {}

    def once(*given: Any) -> Any:
        name = key(given)
        if name not in found:
            found[name] = make(*given)
        return found[name]

    return once


def _run_key(given: tuple[Any, ...]) -> str:
    """Return the hash of what a run was recorded in, its folder's name and the other arguments."""
    folder = RunFolder(Path(given[0]).resolve())
    parts = (folder.journal.parent / name for name in ("cell", "plan", "streams"))
    journal = folder.journal.read_bytes() if folder.journal.is_file() else b""
    hashes = [content_hash(part) for part in parts]
    return str(joblib.hash((folder.path.name, journal, hashes, given[1:])))


def _figure_key(given: tuple[Any, ...]) -> str:
    """Return the hash of what is drawn: the function, what it is given, and the language."""
    draw, say = given
    return str(joblib.hash((draw.func, draw.args, draw.keywords, say and say.__self__.code)))
