"""The person at the cell, as a run needs one: an argument, never a question asked from below."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Protocol

from elastocal.errors import ProcedureError
from elastocal.procedure import Progress as RunProgress


@dataclass(frozen=True)
class Supervision:
    """The operator's part while the arm moves."""

    show: Callable[[RunProgress], None]
    """Takes note of every step; never raises, never waits."""
    interrupted: Callable[[], bool]
    """Whether somebody wants the run to stop: it releases, retracts and stops."""


class Operator(Protocol):
    """The person at the cell."""

    def warn(self, lines: Sequence[str]) -> None:
        """Read what should be known before anything moves."""

    def confirm(self) -> None:
        """Agree that the cell is clear, or raise `ProcedureError`."""

    def supervise(self, poses: int) -> AbstractContextManager[Supervision]:
        """Watch while the arm moves to this number of poses."""


class Unattended:
    """Nobody: agrees to nothing, interrupts nothing, hears progress by the callable alone."""

    def warn(self, lines: Sequence[str]) -> None:
        """Read nothing."""

    def confirm(self) -> None:
        """Refuse.

        Raises
        ------
        ProcedureError
            Always.
        """
        raise ProcedureError("a person must confirm that the cell is clear: give --yes")

    @contextmanager
    def supervise(self, poses: int) -> Iterator[Supervision]:  # noqa: ARG002 - the protocol's form
        """Watch nothing."""
        yield Supervision(lambda _step: None, lambda: False)
