"""What readings show without a fit: contradictions, dead, repeated and rounded columns."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from elastocal.dataset import Readings
from elastocal.findings import Finding, Grade, Kind, as_number
from elastocal.identification.mistakes._common import AXES, MM, median_norm
from elastocal.identification.mistakes._motion import contradictions
from elastocal.robot import Robot

_DEAD = 5e-3
"""Part of what is usual below which an axis is dead: noise of an instrument is larger."""
_MOVED = 0.1
"""Part of the motion from which an axis has one that the tracker must see."""
_BENT = 0.3
"""Part of the median deflection that no arm has without a force."""
_PRESSED_ALONG = (("north", "south"), ("east", "west"), ("normal",))
"""Load cases that press along each axis of the tcp (docs/conventions.md)."""
_STEPS = (1e-3, 1e-4, 1e-5)
_GRAIN = 0.05
"""Part of the median deflection that a step of rounding may have."""


def find_implausible(
    robot: Robot, readings: Readings, marker_offset: ArrayLike | None = None
) -> tuple[Finding, ...]:
    """Return what readings show to be wrong without a fit.

    Parameters
    ----------
    robot : Robot
        The robot.
    readings : Readings
        With joints in the robot's order.
    marker_offset : array_like, shape (3,), optional
        Marker in the tcp frame, in m.
    """
    offset = np.zeros(3) if marker_offset is None else np.asarray(marker_offset, dtype=float)
    found = [*contradictions(robot, readings, offset)]
    if any(each.grade is Grade.REFUSAL for each in found):
        # What follows would be computed from wrong joints.
        return tuple(found)
    dead = [*_dead_forces(robot, readings)]
    found += dead or [*_zero_loads(readings)]
    found += [*_rounded(readings)] or [*_dead_markers(readings)]
    return (*found, *_repeated(readings))


DEAD_FORCE = Kind(
    "mistakes.dead-force",
    "force_{axis} in the tcp frame is dead: below {size} N in all readings,"
    " although load cases press along it; check the sensor's channel and the map",
    shown={"size": as_number(".2g")},
)
ZERO_LOAD = Kind(
    "mistakes.no-force-in-load-case",
    "no force is read in load case {case}, where the arm deflects by {deflection}"
    " mm: zeroed in contact? Zero the sensor in the air, before each pose",
    grade=Grade.REFUSAL,
    shown={"case": repr, "deflection": MM},
)
DEAD_MARKER = Kind(
    "mistakes.dead-marker",
    "marker_displacement_{axis} is dead, or in metres or inches in a column of mm:"
    " {seen} mm, where the controller moved by {told} mm (median); check the tracker's"
    " column",
    shown={"seen": as_number(".2g", 1e3), "told": as_number(".2g", 1e3)},
)
REPEATED = Kind(
    "mistakes.repeated-readings",
    "readings of pose {poses} are the same to the last digit under different load"
    " cases: a copied row, or a stream that stood still; leave them out (--exclude)",
)
ROUNDED = Kind(
    "mistakes.rounded-displacements",
    "displacements are rounded to {step} mm, {part} of the median deflection: export more digits",
    shown={"step": as_number("g", 1e3), "part": as_number(".0%")},
)


def _dead_forces(robot: Robot, readings: Readings) -> Iterator[Finding]:
    """Yield axes of the tcp along which no force is read although load cases are named so."""
    R = robot.forward(readings.joint_position)[:, :3, :3]
    own = np.einsum("rji,rj->ri", R, readings.force)
    size = median_norm(readings.force)
    for axis, (name, cases) in enumerate(zip(AXES, _PRESSED_ALONG, strict=True)):
        pressed = np.isin(readings.load_case, cases)
        if pressed.any() and float(np.abs(own[:, axis]).max()) < _DEAD * size:
            yield DEAD_FORCE(axis=name, size=_DEAD * size)


def _zero_loads(readings: Readings) -> Iterator[Finding]:
    """Yield load cases that read no force although the arm deflects as under others."""
    size, deflection = np.linalg.norm(readings.force, axis=1), readings.deflection
    for case in dict.fromkeys(readings.load_case.tolist()):
        own = readings.load_case == case
        if float(size[own].max()) < _DEAD * float(np.median(size)) and median_norm(
            deflection[own]
        ) > _BENT * median_norm(deflection):
            yield ZERO_LOAD(case=case, deflection=median_norm(deflection[own]))


def _dead_markers(readings: Readings) -> Iterator[Finding]:
    """Yield axes along which the tracker sees next to nothing of what the controller moves."""
    told = np.median(np.abs(readings.controller_displacement), axis=0)
    seen = np.median(np.abs(readings.marker_displacement), axis=0)
    moves = told > _MOVED * np.linalg.norm(told)
    dead = moves & (seen < _DEAD * told)
    for axis in np.flatnonzero(dead).tolist():
        yield DEAD_MARKER(axis=AXES[axis], seen=float(seen[axis]), told=float(told[axis]))


def _repeated(readings: Readings) -> Iterator[Finding]:
    """Yield poses at which several load cases read exactly the same."""
    rows = np.column_stack([readings.force, readings.marker_displacement])
    poses = [
        int(pose)
        for pose in np.unique(readings.pose)
        if np.any(rows[readings.pose == pose])
        and len(np.unique(rows[readings.pose == pose], axis=0))
        < np.count_nonzero(readings.pose == pose)
    ]
    if poses:
        yield REPEATED(poses=poses)


def _rounded(readings: Readings) -> Iterator[Finding]:
    """Yield that displacements are rounded to a step that is large beside the deflection."""
    size = median_norm(readings.deflection)
    values = np.concatenate([readings.marker_displacement, readings.controller_displacement])
    for step in _STEPS:
        steps = values / step
        if np.abs(steps - np.round(steps)).max() < 1e-3 and step > _GRAIN * size:
            yield ROUNDED(step=step, part=step / size)
            return
