"""Progress of long work: one small protocol, passed as an argument from the command down."""

from typing import Protocol


class Progress(Protocol):
    """Called with stage, done and total while work goes on.

    Whoever works calls it with the name of the stage, how much of it is done and how much there
    is; it never raises and never waits.
    """

    def __call__(self, stage: str, done: int, total: int, /) -> None:
        """Take note of ``done`` of ``total`` steps of a stage."""


def silent(_stage: str, _done: int, _total: int, /) -> None:
    """Show nothing."""
