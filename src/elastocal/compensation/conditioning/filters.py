"""Filters of the wrench, with their delay: median for spikes, notch, Butterworth low-pass.

Designs are SciPy's; the steps are the ones that the C export takes, in the same order: a median
of the last readings, then second-order sections in the transposed direct form II,

    y = b0 x + z1,    z1' = b1 x - a1 y + z2,    z2' = b2 x - a2 y.

Every section is scaled to pass a constant unchanged. Last may come a lead,

    y = x + lead / sample (x - x1),

which goes ahead along the slope of what was filtered, by as much as filters and controller are
late. A further linear filter is a `WrenchFilter` here, and its key in `FilterSettings`, or one of
another package: compensator and C export run whatever sections there are.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import AfterValidator, BeforeValidator, SerializeAsAny

from elastocal import plugins
from elastocal.arrays import FloatArray
from elastocal.errors import CompensationError
from elastocal.records import StrictModel, validate
from elastocal.results import brief_repr
from elastocal.units import parse_quantity

Section = tuple[float, float, float, float, float]
"""b0, b1, b2, a1, a2; a0 is 1."""
_MEDIANS = (1, 3, 5)
"""Lengths of the median filter; 1 is no filter."""
_LARGEST_ORDER = 8
"""Highest order of the low-pass: with more, sections lose digits and the delay is too long."""
_LONGEST_LEAD = 0.1
"""Longest time to go ahead along a slope, in s: for longer no slope of a force stays as it is."""
_LONGEST_DELAY = 0.5
"""Longest delay of all filters together, in s."""


def _positive(value: float) -> float:
    if not 0.0 < value < math.inf:
        raise ValueError("must be above 0")
    return value


def _quantity(dimension: str) -> BeforeValidator:
    return BeforeValidator(lambda text: parse_quantity(text, dimension))


Frequency = Annotated[float, _quantity("frequency"), AfterValidator(_positive)]
"""In Hz, above 0."""
Duration = Annotated[float, _quantity("time"), AfterValidator(_positive)]
"""In s, above 0."""
Speed = Annotated[float, _quantity("speed"), AfterValidator(_positive)]
"""In m/s, above 0."""


@brief_repr
@dataclass(frozen=True)
class FilterChain:
    """A median and second-order sections, for one sampling time."""

    sample: float
    """Time between two readings, in s."""
    median: int = 1
    """Readings that the median is taken of: 1 (none), 3 or 5."""
    sections: tuple[Section, ...] = ()

    def __post_init__(self) -> None:
        if self.median not in _MEDIANS:
            raise CompensationError(f"median of {self.median} readings: allowed are 1, 3 and 5")

    def delay(self, frequency: ArrayLike = 0.0) -> FloatArray:
        """Return the group delay, the median's ``(n - 1) / 2`` readings included, less a lead.

        With ``H = B/A`` and ``z = exp(i w)`` the delay of a polynomial ``P`` of ``1/z`` is the
        real part of ``sum(k p_k z^-k) / P`` in readings (Oppenheim and Schafer, Discrete-Time
        Signal Processing, section 5.1); of ``H`` it is that of ``B`` less that of ``A``.

        Parameters
        ----------
        frequency : array_like
            In Hz, from 0 to half the sampling rate.

        Returns
        -------
        ndarray
            In s; NaN at the middle of a notch, through which nothing passes.
        """
        z = np.exp(-2j * np.pi * np.asarray(frequency, dtype=float) * self.sample)
        readings = np.full(z.shape, 0.5 * (self.median - 1))
        for b0, b1, b2, a1, a2 in self.sections:
            readings = readings + _delay((b0, b1, b2), z) - _delay((1.0, a1, a2), z)
        return readings * self.sample

    def gain(self, frequency: ArrayLike) -> FloatArray:
        """Return the gain of an oscillation through the sections; above 1 only with a lead."""
        z = np.exp(-2j * np.pi * np.asarray(frequency, dtype=float) * self.sample)
        passed = np.ones(z.shape)
        for b0, b1, b2, a1, a2 in self.sections:
            passed = passed * np.abs((b0 + b1 * z + b2 * z * z) / (1.0 + a1 * z + a2 * z * z))
        return passed


class WrenchFilter(StrictModel, ABC):
    """Settings of a linear filter; those of another package have a field ``kind``, their name."""

    @abstractmethod
    def sections(self, sample: float) -> tuple[Section, ...]:
        """Return its sections for a sampling time in s, each of which passes a constant."""


FILTERS = plugins.Registry[type[WrenchFilter]]("filter", {}, CompensationError)
"""Filters of other packages; those of elastocal have keys of their own in the settings."""


def _made(given: object) -> object:
    """Return a filter of another package from what a file says of it."""
    if isinstance(given, WrenchFilter):
        return given
    kind = given.get("kind") if isinstance(given, Mapping) else None
    if not isinstance(kind, str) or kind not in FILTERS:
        allowed = ", ".join(FILTERS) or "none is installed"
        raise ValueError(f"unknown kind {kind!r} (allowed: {allowed})")
    return validate(given, FILTERS[kind], kind)


class LowPass(WrenchFilter):
    """Settings of a Butterworth low-pass."""

    cutoff: Frequency
    order: int = 2

    def sections(self, sample: float) -> tuple[Section, ...]:
        """Return its sections for a sampling time in s; see `low_pass`."""
        return low_pass(self.cutoff, self.order, sample)


class Notch(WrenchFilter):
    """Settings of a notch for one line."""

    frequency: Frequency
    width: Frequency

    def sections(self, sample: float) -> tuple[Section, ...]:
        """Return its section for a sampling time in s; see `notch`."""
        return notch(self.frequency, self.width, sample)


class FilterSettings(StrictModel):
    """Settings of the filters that smooth the wrench."""

    sample: Duration | None = None
    """Time between two readings, in s; the cycle by default."""
    median: Literal[1, 3, 5] = 3
    notches: tuple[Notch, ...] = ()
    others: tuple[Annotated[SerializeAsAny[WrenchFilter], BeforeValidator(_made)], ...] = ()
    """Filters of other packages, between the notches and the low-pass."""
    low_pass: LowPass | None = LowPass.model_construct(cutoff=15.0)
    lead: Duration | None = None
    """Time to go ahead along the slope of the filtered wrench, in s: the delay of these filters and
    of the controller, as measured. None: a correction is late by both."""

    def off(self) -> "FilterSettings":
        """Return the same settings without any filter; readings come as often."""
        none = {"median": 1, "notches": (), "others": (), "low_pass": None, "lead": None}
        return self.model_copy(update=none)

    def chain(self, cycle: float) -> FilterChain:
        """Return the filters; new objects at every call.

        Parameters
        ----------
        cycle : float
            Time between two corrections, in s: that of the readings where ``sample`` is not given.

        Raises
        ------
        CompensationError
            If a frequency is not below half the rate of readings, they delay a wrench too long, or
            a lead is too long or goes along unfiltered readings.
        """
        sample = self.sample or cycle
        sections = tuple(section for each in self.notches for section in each.sections(sample))
        for other in self.others:
            name = str(getattr(other, "kind", ""))
            sections += plugins.used(FILTERS.kind, name, partial(other.sections, sample))
        if self.low_pass is not None:
            sections += self.low_pass.sections(sample)
        if self.lead is not None:
            if self.low_pass is None:
                raise CompensationError(
                    "filter.lead needs a low_pass: the slope of readings as they come is noise"
                )
            sections += (lead_section(self.lead, sample),)
        chain = FilterChain(sample, self.median, sections)
        delay = float(chain.delay())
        if not delay <= _LONGEST_DELAY:
            raise CompensationError(
                f"the filters delay a slow wrench by {delay:.4g} s: at most {_LONGEST_DELAY:g} s,"
                " after that it no longer is what acts"
            )
        return chain


def low_pass(cutoff: float, order: int, sample: float) -> tuple[Section, ...]:
    """Return a Butterworth low-pass as second-order sections.

    Parameters
    ----------
    cutoff : float
        Frequency of which it passes 71 %, in Hz.
    order : int
        1 to 8.
    sample : float
        Time between two readings, in s.

    Raises
    ------
    CompensationError
        If the cut-off is not between 0 and half the sampling rate, or the order is not allowed.
    """
    _check_frequency("low-pass cut-off", cutoff, sample)
    if order not in range(1, _LARGEST_ORDER + 1):
        raise CompensationError(f"low-pass order {order}: allowed are 1 to {_LARGEST_ORDER}")
    # Takes half a second to import, and few wrenches are filtered so.
    from scipy import signal

    return _sections(signal.butter(order, cutoff, fs=1.0 / sample, output="sos"))


def notch(frequency: float, width: float, sample: float) -> tuple[Section, ...]:
    """Return a notch as one second-order section.

    Parameters
    ----------
    frequency : float
        What it takes out, in Hz: a spindle's line, a tooth-passing frequency.
    width : float
        Distance of the frequencies of which it passes 71 %, in Hz.
    sample : float
        Time between two readings, in s.

    Raises
    ------
    CompensationError
        If it does not lie between 0 and half the sampling rate.
    """
    _check_frequency("notch", frequency, sample)
    if not 0.0 < width < 2.0 * frequency:
        raise CompensationError(
            f"notch width {width:g} Hz must be above 0 and below twice its {frequency:g} Hz"
        )
    from scipy import signal

    b, a = signal.iirnotch(frequency, frequency / width, fs=1.0 / sample)
    return _sections(np.concatenate([b, a])[None])


def lead_section(time: float, sample: float) -> Section:
    """Return the section that goes ahead along a slope by a time, both in s.

    A slow wrench comes out earlier by the time; an oscillation of frequency ``f`` comes out larger
    by about ``2 pi f time``, which is what a low-pass of order 2 and more before it takes back.

    Raises
    ------
    CompensationError
        If the time is too long.
    """
    if not 0.0 < time <= _LONGEST_LEAD:
        raise CompensationError(
            f"lead {time:g} s must be above 0 and at most {_LONGEST_LEAD:g} s: for longer no slope"
            " of a force stays as it is"
        )
    # y[k] = x[k] + ahead (x[k] - x[k-1]): extrapolation along the last difference.
    ahead = time / sample
    return 1.0 + ahead, -ahead, 0.0, 0.0, 0.0


def _check_frequency(what: str, frequency: float, sample: float) -> None:
    if not 0.0 < frequency < 0.5 / sample:
        raise CompensationError(
            f"{what} {frequency:g} Hz must be above 0 and below {0.5 / sample:g} Hz, half the rate"
            f" of readings ({1.0 / sample:g} Hz): what is faster cannot be told from slower"
        )


def _sections(sos: FloatArray) -> tuple[Section, ...]:
    made = []
    for row in np.asarray(sos, dtype=float):
        b, (_, a1, a2) = row[:3], row[3:].tolist()
        # The gain at rest is made exactly 1: every constant force would otherwise carry the
        # rounding of the design.
        b0, b1, b2 = (b * ((1.0 + a1 + a2) / b.sum())).tolist()
        made.append((b0, b1, b2, a1, a2))
    return tuple(made)


def _delay(polynomial: Sequence[float], z: FloatArray) -> FloatArray:
    p0, p1, p2 = polynomial
    value = p0 + p1 * z + p2 * z * z
    # At a zero on the unit circle, such as the line of a notch, the phase jumps and there is no
    # delay.
    gone = np.abs(value) < 1e-12 * (abs(p0) + abs(p1) + abs(p2))
    ratio = (p1 * z + 2.0 * p2 * z * z) / np.where(gone, 1.0, value)
    return np.where(gone, np.nan, ratio.real)
