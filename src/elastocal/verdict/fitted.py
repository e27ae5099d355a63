"""Tested poses and loads by the readings alone, since plan and cell file state intentions."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.dataset import Readings
from elastocal.results import brief_repr
from elastocal.robot import Robot
from elastocal.verdict.evidence import Evidence
from elastocal.wording import Phrase, counted, phrase

_LEVEL = 0.5
"""Forces nearer to 0 than this, in N, are shown as none."""


@brief_repr
@dataclass(frozen=True, eq=False)
class FittedReadings:
    """The readings that the calibration rests on."""

    pose: IndexArray
    """Shape (reading,)."""
    load_case: tuple[str, ...]
    deflection: FloatArray
    """Shape (reading, 3), in base, in m."""
    force_tcp: FloatArray
    """Measured force on the robot in the tcp frame, shape (reading, 3), in N."""

    @cached_property
    def forces(self) -> Mapping[tuple[int, str], FloatArray]:
        """Measured force of each reading by pose and load case, shape (3,), in N."""
        names = zip(self.pose.tolist(), self.load_case, strict=True)
        return dict(zip(names, self.force_tcp, strict=True))

    def sentence(self) -> Phrase:
        """Return the number of poses and the range of the forces."""
        along, aside = -self.force_tcp[:, 2], np.hypot(*self.force_tcp[:, :2].T)
        return phrase(
            "{poses}; {press}, up to {aside} N sideways",
            poses=counted(len(np.unique(self.pose)), "pose"),
            press=_pressing(float(along.min()), float(along.max())),
            aside=f"{aside.max():.0f}",
        )


def place_of_force(name: Phrase, force_tcp: FloatArray) -> Phrase:
    """Return the name of a reading with its measured force.

    Parameters
    ----------
    name : Phrase
        Pose and load case.
    force_tcp : ndarray, shape (3,)
        Measured force on the robot in the tcp frame, in N.
    """
    x, y, z = force_tcp
    press, aside = _pressing(-z, -z), f"{np.hypot(x, y):.0f}"
    if aside == "0":
        return phrase("{name} ({press})", name=name, press=press)
    return phrase("{name} ({press}, {aside} N sideways)", name=name, press=press, aside=aside)


def _pressing(low: float, high: float) -> Phrase:
    """Return a range of forces along the tool in words: positive ones press, negative ones pull."""
    if low < -_LEVEL < _LEVEL < high:
        return phrase(
            "{pull} N pulling to {press} N pressing", pull=f"{-low:.0f}", press=f"{high:.0f}"
        )
    pulls = high < -_LEVEL
    first, last = (f"{each:.0f}" for each in sorted((abs(low), abs(high))))
    span = first if first == last else phrase("{low} to {high}", low=first, high=last)
    if pulls:
        return phrase("{force} N pulling", force=span)
    return phrase("{press} N pressing", press=span)


def fitted_readings(evidence: Evidence) -> FittedReadings | None:
    """Return the readings that errors at unseen poses are known of, or else all usable ones.

    Parameters
    ----------
    evidence : Evidence
        Whatever is there.

    Returns
    -------
    FittedReadings or None
        None where there are no readings, or no robot whose joints tell the tool's attitude.
    """
    dataset, robot = evidence.calibrated_from, _robot(evidence)
    if dataset is None or robot is None:
        return None
    readings = dataset.readings(robot.joint_names)
    if evidence.unseen is not None:
        readings = _only(readings, evidence.unseen.pose, evidence.unseen.load_case)
    if not len(readings):
        return None
    R_base_tcp = robot.forward(readings.joint_position)[:, :3, :3]
    return FittedReadings(
        readings.pose,
        tuple(map(str, readings.load_case.tolist())),
        readings.deflection,
        np.einsum("nji,nj->ni", R_base_tcp, readings.force),
    )


def _robot(evidence: Evidence) -> Robot | None:
    if evidence.calibrated is not None:
        return evidence.calibrated.model.model.robot
    return None if evidence.cell is None else evidence.cell.robot


def _only(readings: Readings, pose: IndexArray, load_case: tuple[str, ...]) -> Readings:
    """Return the readings of some poses and load cases."""
    wanted = set(zip(pose.tolist(), load_case, strict=True))
    names = zip(readings.pose.tolist(), readings.load_case.tolist(), strict=True)
    return readings.take(np.array([each in wanted for each in names], dtype=bool))
