"""Sizes of forces and deflections against the arm's own rule of thumb.

A gear winds up by some 2 mrad under the torque that its joint may use. That torque is the URDF's;
else the weight of the arm or its reach says it. A fit may be softer or stiffer than the rule by a
factor of two or three, and a campaign may press lightly; a wrong unit of the force does both at
once (docs/decisions/0105-mistakes-undone.md).
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, actuated
from elastocal.findings import Finding, Kind, as_number
from elastocal.identification.mistakes._common import median_norm
from elastocal.robot import Robot
from elastocal.wording import phrase

_WIND_UP = 2e-3
_DRIVE = 4e7
_TORQUES = np.array([1.0, 1.0, 0.8, 0.26, 0.26, 0.16])
"""Torque that each joint of an arm of six axes may use over that of its second."""
_RATIO, _RATIO_SPREAD = np.log(1.3), np.log(2.0)
"""Logarithm of the measured deflection over the rule's, and its spread over arms."""
_SHARE, _SHARE_SPREAD = np.log(0.2), np.log(2.2)
"""The same of the part of its torques that a campaign loads an arm with."""
_TOO_MUCH = 1.5
"""Share of its torques that no arm carries."""
_LIKELIER = 3.5
"""By how much twice the logarithm of the likelihood has to rise for a unit to be suspected."""
_FORCE_UNITS = (
    ("lbf", np.log(4.4482216)),
    ("kgf (daN)", np.log(9.80665)),
    ("kN", np.log(1e3)),
)
_WEIGHTS = 1.6
_REACHES = 40.0
"""In N·m per m to the fifth."""


UNIT_OF_FORCE = Kind(
    "mistakes.unit-of-force",
    "forces look like {unit} in a column of N: they load the arm with {share} of"
    " its torques, and it seems {times} times as compliant as the rule of thumb for"
    " such arms; check the unit of the sensor",
    shown={"share": as_number(".1%"), "times": as_number(".2g")},
)
COUNTS = Kind(
    "mistakes.counts",
    "forces look like counts, or another unit than N: they load a joint with {share}"
    " of what it carries; check the unit of the sensor (`counts` in a map)",
    shown={"share": as_number(".0%")},
)
UNIT_OF_DISPLACEMENT = Kind(
    "mistakes.unit-of-displacement",
    "displacements look like {unit}: the arm seems {times} times as compliant as"
    " the rule of thumb for such arms; check the unit of tracker and controller",
    shown={"times": as_number(".2g")},
)


def find_wrong_units(
    robot: Robot, readings: Readings, marker_offset: ArrayLike | None = None
) -> Iterator[Finding]:
    """Yield units in which forces or displacements would be of the size that they have on arms.

    Parameters
    ----------
    robot, readings, marker_offset
        As for `find_implausible`.
    """
    sizes = _sizes(robot, readings, marker_offset)
    if sizes is None:
        return
    ratio, share = sizes
    r, s = np.log(ratio) - _RATIO, np.log(share) - _SHARE
    likelier = {
        unit: (r**2 - (r - k) ** 2) / _RATIO_SPREAD**2 + (s**2 - (s + k) ** 2) / _SHARE_SPREAD**2
        for unit, k in _FORCE_UNITS
    }
    if units := [unit for unit, gain in likelier.items() if gain > _LIKELIER]:
        likeliest = units[:2] if likelier["kN"] < likelier["lbf"] else units[-1:]
        yield UNIT_OF_FORCE(unit=" or ".join(likeliest), share=share, times=ratio)
        return
    if share > _TOO_MUCH:
        yield COUNTS(share=share)
        return
    for word, k in (
        (phrase("inches in a column of mm"), np.log(25.4)),
        (phrase("mm in a column of inches"), -np.log(25.4)),
    ):
        gain = (r**2 - (r + k) ** 2) / _RATIO_SPREAD**2
        if gain > _LIKELIER:
            yield UNIT_OF_DISPLACEMENT(unit=word, times=ratio)


def _sizes(
    robot: Robot, readings: Readings, marker_offset: ArrayLike | None
) -> tuple[float, float] | None:
    """Return the median deflection over the rule's, and the part of its torques in use."""
    torque = usual_torques(robot)
    if torque is None:
        return None
    model = ElasticModel(robot, actuated(robot))
    turning = np.array(robot.revolute)
    loads = readings.joint_position, readings.force, readings.moment
    softness = 1.0 / np.where(turning, torque / _WIND_UP, _DRIVE)
    rule = median_norm(model.observation_blocks(*loads, marker_offset) @ softness)
    used = np.abs(model.load_torques(*loads)) / torque
    share = float(np.median(used[:, turning].max(axis=1)))
    deflection = median_norm(readings.deflection)
    if not (rule > 0.0 and share > 0.0 and deflection > 0.0):
        return None
    return deflection / rule, share


def usual_torques(robot: Robot) -> FloatArray | None:
    """Return the torque that each joint may use, shape (joint,), in N·m; None for small arms.

    As the URDF says it; else 1.6 times the largest torque of the arm's own weight about its second
    joint, which is what 17 arms of the catalogue have within 1.1 to 2.7; else by the reach to its
    fifth power, which holds for arms of 1.4 to 3.6 m.
    """
    first, count = robot.external_axes, len(robot.joint_names)
    known = np.nan_to_num(robot.limits.effort)
    arm = known[first:]
    if len(arm) != len(_TORQUES):
        return None
    torque = np.full(count, np.inf)
    torque[first:] = arm if np.all(arm > 0.0) else _TORQUES * _shoulder_torque(robot)
    return torque


def _shoulder_torque(robot: Robot) -> float:
    """Return the torque that the second joint of an arm may use, in N·m."""
    first = robot.external_axes
    if robot.has_masses:
        turns = np.linspace(-np.pi, np.pi, 13)
        q = np.zeros((len(turns) ** 2, len(robot.joint_names)))
        q[:, first + 1], q[:, first + 2] = (each.ravel() for each in np.meshgrid(turns, turns))
        held = float(np.abs(robot.gravity_torques(q)[:, first + 1]).max())
        if held > 0.0:
            return _WEIGHTS * held
    lengths = [np.linalg.norm(each.placement[:3, 3]) for each in robot.chain.joints[first + 1 :]]
    return _REACHES * float(sum(lengths)) ** 5
