"""Counts of drivers on the lines of their devices, for the inspection of a run."""

from elastocal.records import record
from elastocal.results import brief_repr

COUNTED = (
    ("lost", "lost"),
    ("late", "late"),
    ("out_of_order", "out of order"),
    ("jumps", "jumps"),
    ("malformed", "malformed"),
    ("foreign", "foreign"),
    ("saturated", "saturated"),
    ("breaks", "broken off"),
)
"""Fields of `LineCounts` that should be 0, with their names for people."""


@brief_repr
@record()
class LineCounts:
    """Counts of a driver on the line of a device since it was opened."""

    device: str
    """Name of the device with its address."""
    received: int
    """Messages, records or points."""
    lost: int = 0
    """Messages that never arrived, or that a newer one overtook."""
    late: int = 0
    """Answers or samples that came too late for use."""
    out_of_order: int = 0
    jumps: int = 0
    """Number of times that the device's counter has jumped because it was restarted."""
    malformed: int = 0
    foreign: int = 0
    """Messages of others than the device; they are not read."""
    saturated: int = 0
    """Samples beyond a range; cycles in which the controller clamped a correction."""
    breaks: int = 0
    """Times that the beam, or the connection, was lost."""
    status: tuple[str, ...] = ()
    """Errors that the device has reported, by name."""
    answer: tuple[float, float, float] | None = None
    """Time of answers, median, 99 %, longest, in s; None where nothing is answered."""
    refused: str = ""
    """Why malformed messages were refused; empty where the driver does not say."""

    def sentence(self) -> str:
        """Return the counts in words; zeros are left out."""
        return f"{self.device}: {self.figures()}"

    def figures(self) -> str:
        """Return the same without the device."""
        counts = [(name, getattr(self, key)) for key, name in COUNTED]
        wrong = [f"{count} {name}" for name, count in counts if count] + [*self.status]
        wrong += [f"refused: {self.refused}"] if self.refused else []
        text = f"{self.received} received, {', '.join(wrong) or 'none lost'}"
        if self.answer is None:
            return text
        times = " / ".join(f"{1e3 * each:.2f}" for each in self.answer)
        return f"{text}; answered in {times} ms (median, 99 %, longest)"

    def plus(self, other: "LineCounts") -> "LineCounts":
        """Return the counts of two sessions together; of times of answers the longer."""
        sums = {key: getattr(self, key) + getattr(other, key) for key, _ in COUNTED}
        times = [each for each in (self.answer, other.answer) if each is not None]
        a, b, c = zip(*times, strict=True) if times else ((), (), ())
        return LineCounts(
            device=self.device,
            received=self.received + other.received,
            status=tuple(dict.fromkeys(self.status + other.status)),
            answer=(max(a), max(b), max(c)) if times else None,
            refused=self.refused or other.refused,
            **sums,
        )


def refused_telegrams(malformed: int, refused: str, foreign: int) -> str:
    """Return in words what came on a line from which nothing could be read.

    >>> refused_telegrams(1600, "RIst.X is '1620,9999', no number: decimal comma", 0)
    "1600 telegrams refused: RIst.X is '1620,9999', no number: decimal comma"

    Parameters
    ----------
    malformed : int
        Telegrams that were refused.
    refused : str
        Why.
    foreign : int
        Datagrams of others than the device.
    """
    said = [f"{malformed} telegrams refused: {refused}"] if malformed else []
    said += [f"{foreign} datagrams from elsewhere"] if foreign else []
    return "; ".join(said) or "no datagram came"


def no_lines() -> tuple[LineCounts, ...]:
    """Return no counts: of devices without a line."""
    return ()
