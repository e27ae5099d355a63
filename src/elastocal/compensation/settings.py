"""Settings of the online compensator, as in its file.

Example:

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
    friction: {free_below: 0.5, free_after: "200 ms"}
"""

import math
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Discriminator, Field, Tag, model_validator

from elastocal.arrays import FloatArray
from elastocal.cell import (
    Angle,
    Distance,
    PositiveForce,
    PositiveLength,
    PositiveMoment,
)
from elastocal.compensation.conditioning import Duration, FilterChain, FilterSettings, Speed
from elastocal.dataset import LARGEST_FORCE, LARGEST_MOMENT
from elastocal.errors import CompensationError
from elastocal.records import StrictModel, read_yaml
from elastocal.robot import T_from_xyzabc

_SCHEMA = "elastocal.compensator/1"

_LARGEST_CORRECTION = 0.05
"""In m: no arm in use deflects by more."""
_LARGEST_OFFSET = 2e-3
"""In m: more than an arm grows in a shift, as `growth` has it."""
_LARGEST_RATE = 1.0
"""In m/s."""
_LONGEST_HOLD = 1.0
"""In s: an older measurement does not describe the present load."""


_RangeForce = Annotated[PositiveForce, Field(le=LARGEST_FORCE)]
_RangeMoment = Annotated[PositiveMoment, Field(le=LARGEST_MOMENT)]


class CorrectionLimits(StrictModel):
    """Limits that the correction never exceeds."""

    correction: Annotated[PositiveLength, Field(le=_LARGEST_CORRECTION)] = 3e-3
    """Length of the correction, in m."""
    rate: Annotated[Speed, Field(le=_LARGEST_RATE)] = 0.03
    """Speed at which it changes, in m/s."""
    fade: Speed = 0.005
    """Speed at which it goes to zero when readings fail, in m/s; at most `rate`."""
    offset: Annotated[PositiveLength, Field(le=_LARGEST_OFFSET)] = 1e-3
    """Largest offset of a course that a reading in light contact may ask for, in m; a larger one is
    not taken."""

    @model_validator(mode="after")
    def _fades_within_the_rate(self) -> "CorrectionLimits":
        if not self.fade <= self.rate:
            raise ValueError(f"fade {self.fade:g} m/s is above rate {self.rate:g} m/s")
        return self


class SensorRange(StrictModel):
    """The range of the sensor; beyond it, a reading is saturated."""

    force: tuple[_RangeForce, _RangeForce, _RangeForce] = (LARGEST_FORCE,) * 3
    """In N."""
    moment: tuple[_RangeMoment, _RangeMoment, _RangeMoment] = (LARGEST_MOMENT,) * 3
    """In N·m."""


class FrictionReset(StrictModel):
    """When the arm counts as moving freely, which wears the memory of friction off."""

    free_below: Annotated[float, Field(gt=0.0, le=1.0)] = 0.5
    """Share of an axis' smallest friction limit that the load stays below about every axis with
    friction; its torque is then within the sensor's noise, as in the air."""
    free_after: Annotated[Duration, Field(le=_LONGEST_HOLD)] = 0.2
    """Time for which it must, in s: a load that passes through zero is no free motion."""


class EncoderSettings(StrictModel):
    """Secondary encoders that are read in production."""

    joints: tuple[str, ...] = ()
    """Joints that have one."""
    average: Annotated[Duration, Field(le=_LONGEST_HOLD)] = 0.02
    """Time constant with which noise of the encoders is smoothed, in s: what they add to the model
    is friction and slow errors."""


class FixedFrame(StrictModel):
    """A frame of fixed rotation in base, such as a controller's ``$BASE``."""

    abc: tuple[Angle, Angle, Angle]
    """KUKA's A, B, C, in rad."""


class CompensatorSettings(StrictModel):
    """Settings of a compensator: how it corrects."""

    cycle: Duration = 0.004
    """Time between two corrections, in s."""
    frame: Annotated[
        Annotated[Literal["base", "tcp"], Tag("name")] | Annotated[FixedFrame, Tag("turned")],
        Discriminator(lambda given: "turned" if isinstance(given, dict | FixedFrame) else "name"),
    ] = "base"
    """Axes that the correction is expressed in."""
    gain: Annotated[float, Field(ge=0.0, le=1.0)] = 1.0
    """Share of the deflection that is corrected; below 1 while a cell is put into service."""
    limits: CorrectionLimits = CorrectionLimits()
    deadband: Distance = 0.0
    """Deflections below it are not corrected, above twice it fully, in m."""
    hold: Annotated[Duration, Field(le=_LONGEST_HOLD)] = 0.04
    """Time that the correction is held when readings fail before it fades, in s; a reading that
    comes later than this after the one before it is not used either."""
    filter: FilterSettings = FilterSettings()
    sensor: SensorRange = SensorRange()
    uncertain_above: PositiveLength = 2e-4
    """Half the 95 % interval of the predicted deflection beyond which it warns, in m."""
    friction: FrictionReset = FrictionReset()
    encoders: EncoderSettings = EncoderSettings()

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
        """The filters, new at every call. See `FilterSettings.chain` for its errors."""
        return self.filter.chain(self.cycle)

    @property
    def hold_cycles(self) -> int:
        """Corrections that are held."""
        return max(1, round(self.hold / self.cycle))

    @property
    def free_cycles(self) -> int:
        """Corrections without load after which friction is taken to bear nothing."""
        return max(1, round(self.friction.free_after / self.cycle))

    @property
    def encoder_share(self) -> float:
        """Share of a new reading of the encoders in their smoothed one, every cycle."""
        return 1.0 - math.exp(-self.cycle / self.encoders.average)

    @property
    def R_base_frame(self) -> FloatArray | None:
        """Rotation of the correction's axes in base, shape (3, 3); None for the tcp's."""
        if isinstance(self.frame, FixedFrame):
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
    settings = read_yaml(path, CompensatorSettings, _SCHEMA)
    try:
        _ = settings.chain
    except CompensationError as error:
        raise CompensationError(f"{path}: {error}") from error
    return settings
