"""Settings of the online compensator, as a person writes them.

Example::

    schema: elastocal.compensator/1
    cycle: "4 ms"
    frame: base                     # or tcp, or {abc: ["90 deg", "0 deg", "0 deg"]}
    limits: {correction: "3 mm", rate: "30 mm/s", fade: "5 mm/s"}
    deadband: "0.01 mm"
    hold: "40 ms"
    filter:
      sample: "1 ms"
      median: 3
      notches: [{frequency: "200 Hz", width: "20 Hz"}]
      low_pass: {cutoff: "15 Hz", order: 2}
    sensor: {force: ["2500 N", "2500 N", "6250 N"], moment: ["400 N*m", "400 N*m", "400 N*m"]}
    uncertain_above: "0.15 mm"
"""

import math
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import (
    AfterValidator,
    BeforeValidator,
    Discriminator,
    Field,
    Tag,
    model_validator,
)

from elastocal.arrays import FloatArray
from elastocal.cell.description import (
    Angle,
    Distance,
    PositiveForce,
    PositiveLength,
    PositiveMoment,
)
from elastocal.compensation.filters import FilterChain, low_pass, notch
from elastocal.errors import CompensationError
from elastocal.records import StrictModel, read_yaml
from elastocal.robot import T_from_xyzabc
from elastocal.units import parse_quantity

SCHEMA = "elastocal.compensator/1"

LARGEST_FORCE, LARGEST_MOMENT = 1e5, 1e5
"""In N and N·m: what no sensor on a robot reads. Beyond, a number is no reading."""
LARGEST_CORRECTION = 0.05
"""In m: no arm that is worth calibrating yields so far."""
LARGEST_RATE = 1.0
"""In m/s."""
LONGEST_HOLD = 1.0
"""In s: what was measured before is not what acts now."""
LONGEST_DELAY = 0.5
"""Of the filters, in s."""


def _positive(value: float) -> float:
    if not 0.0 < value < math.inf:
        raise ValueError("must be above 0")
    return value


def _quantity(dimension: str) -> BeforeValidator:
    return BeforeValidator(lambda text: parse_quantity(text, dimension))


_POSITIVE = AfterValidator(_positive)
Frequency = Annotated[float, _quantity("frequency"), _POSITIVE]
"""In Hz, above 0."""
Duration = Annotated[float, _quantity("time"), _POSITIVE]
"""In s, above 0."""
PositiveSpeed = Annotated[float, _quantity("speed"), _POSITIVE]
"""In m/s, above 0."""
RangeForce = Annotated[PositiveForce, Field(le=LARGEST_FORCE)]
RangeMoment = Annotated[PositiveMoment, Field(le=LARGEST_MOMENT)]


class Limits(StrictModel):
    """What the correction never exceeds."""

    correction: Annotated[PositiveLength, Field(le=LARGEST_CORRECTION)] = 3e-3
    """Length of the correction, in m."""
    rate: Annotated[PositiveSpeed, Field(le=LARGEST_RATE)] = 0.03
    """Speed at which it changes, in m/s."""
    fade: PositiveSpeed = 0.005
    """Speed at which it goes to zero when readings fail, in m/s; at most `rate`."""

    @model_validator(mode="after")
    def _fades_within_the_rate(self) -> "Limits":
        if not self.fade <= self.rate:
            raise ValueError(f"fade {self.fade:g} m/s is above rate {self.rate:g} m/s")
        return self


class LowPass(StrictModel):
    """A Butterworth low-pass."""

    cutoff: Frequency
    order: int = 2


class Notch(StrictModel):
    """A notch for one line."""

    frequency: Frequency
    width: Frequency


class Filters(StrictModel):
    """What smooths the wrench."""

    sample: Duration | None = None
    """Time between two readings, in s; the cycle by default."""
    median: Literal[1, 3, 5] = 3
    notches: tuple[Notch, ...] = ()
    low_pass: LowPass | None = LowPass.model_construct(cutoff=15.0)


class SensorRange(StrictModel):
    """Beyond it, a reading is saturated."""

    force: tuple[RangeForce, RangeForce, RangeForce] = (LARGEST_FORCE,) * 3
    """In N."""
    moment: tuple[RangeMoment, RangeMoment, RangeMoment] = (LARGEST_MOMENT,) * 3
    """In N·m."""


class Turned(StrictModel):
    """A frame of fixed rotation in base, such as a controller's ``$BASE``."""

    abc: tuple[Angle, Angle, Angle]
    """KUKA's A, B, C, in rad."""


class CompensatorSettings(StrictModel):
    """How a compensator corrects."""

    cycle: Duration = 0.004
    """Time between two corrections, in s."""
    frame: Annotated[
        Annotated[Literal["base", "tcp"], Tag("name")] | Annotated[Turned, Tag("turned")],
        Discriminator(lambda given: "turned" if isinstance(given, dict | Turned) else "name"),
    ] = "base"
    """Axes that the correction is expressed in."""
    gain: Annotated[float, Field(ge=0.0, le=1.0)] = 1.0
    """Share of the deflection that is corrected; below 1 while a cell is put into service."""
    limits: Limits = Limits()
    deadband: Distance = 0.0
    """Deflections below it are not corrected, above twice it fully, in m."""
    hold: Annotated[Duration, Field(le=LONGEST_HOLD)] = 0.04
    """How long the correction is held when readings fail before it fades, in s; a reading that
    comes later than this after the one before it is not used either."""
    filter: Filters = Filters()
    sensor: SensorRange = SensorRange()
    uncertain_above: PositiveLength = 2e-4
    """Half the 95 % interval of the predicted deflection beyond which it warns, in m."""

    @model_validator(mode="after")
    def _can_correct(self) -> "CompensatorSettings":
        if not self.deadband < self.limits.correction:
            raise ValueError(
                f"deadband {1e3 * self.deadband:g} mm must be below limits.correction,"
                f" {1e3 * self.limits.correction:g} mm"
            )
        sample = self.filter.sample or self.cycle
        if not sample < self.hold:
            raise ValueError(
                f"hold {self.hold:g} s is not longer than the time between readings, {sample:g} s:"
                " every reading would come too late"
            )
        return self

    @property
    def chain(self) -> FilterChain:
        """The filters; made anew at every call.

        Raises
        ------
        CompensationError
            If a frequency is not below half the rate of readings, or they delay a wrench too long.
        """
        sample = self.filter.sample or self.cycle
        sections = [s for n in self.filter.notches for s in notch(n.frequency, n.width, sample)]
        if self.filter.low_pass is not None:
            sections += low_pass(self.filter.low_pass.cutoff, self.filter.low_pass.order, sample)
        chain = FilterChain(sample, self.filter.median, tuple(sections))
        delay = float(chain.delay())
        if not delay <= LONGEST_DELAY:
            raise CompensationError(
                f"the filters delay a slow wrench by {delay:.4g} s: at most {LONGEST_DELAY:g} s,"
                " after that it no longer is what acts"
            )
        return chain

    @property
    def hold_cycles(self) -> int:
        """Corrections that are held."""
        return max(1, round(self.hold / self.cycle))

    @property
    def R_base_frame(self) -> FloatArray | None:
        """Rotation of the correction's axes in base, shape (3, 3); None for the tcp's."""
        if isinstance(self.frame, Turned):
            return T_from_xyzabc(0.0, 0.0, 0.0, *self.frame.abc)[:3, :3]
        return np.eye(3) if self.frame == "base" else None


def read_settings(path: Path) -> CompensatorSettings:
    """Return validated settings from a YAML file, its filters checked too.

    Raises
    ------
    SchemaError
        If the file does not fit.
    CompensationError
        If a filter cannot be made.
    FileAccessError
        If it cannot be read.
    """
    settings = read_yaml(path, CompensatorSettings, SCHEMA)
    try:
        _ = settings.chain
    except CompensationError as error:
        raise CompensationError(f"{path}: {error}") from error
    return settings
