"""Time, as an argument: the machine's own, or a simulated one."""

from typing import Protocol


class Clock(Protocol):
    """Seconds that only go forward. Nothing in the procedure asks any other clock."""

    def now(self) -> float:
        """Return the time in s since an origin of the clock's own."""

    def sleep(self, seconds: float) -> None:
        """Let time pass, and no more than that; devices go on meanwhile."""
