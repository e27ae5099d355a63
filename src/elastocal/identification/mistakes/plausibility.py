"""What readings show without a fit: contradictions, dead, repeated and rounded columns."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from elastocal.dataset import Readings
from elastocal.identification.mistakes._motion import contradictions
from elastocal.identification.mistakes._suspicion import AXES, Suspicion, median_norm
from elastocal.robot import Robot
from elastocal.wording import phrase

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
) -> tuple[Suspicion, ...]:
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
    if any(each.certain for each in found):
        # What follows would be computed from wrong joints.
        return tuple(found)
    dead = [*_dead_forces(robot, readings)]
    found += dead or [*_zero_loads(readings)]
    found += [*_rounded(readings)] or [*_dead_markers(readings)]
    return (*found, *_repeated(readings))


def _dead_forces(robot: Robot, readings: Readings) -> Iterator[Suspicion]:
    """Yield axes of the tcp along which no force is read although load cases are named so."""
    R = robot.forward(readings.joint_position)[:, :3, :3]
    own = np.einsum("rji,rj->ri", R, readings.force)
    size = median_norm(readings.force)
    for axis, (name, cases) in enumerate(zip(AXES, _PRESSED_ALONG, strict=True)):
        pressed = np.isin(readings.load_case, cases)
        if pressed.any() and float(np.abs(own[:, axis]).max()) < _DEAD * size:
            yield Suspicion(
                phrase(
                    "force_{axis} in the tcp frame is dead: below {size} N in all readings,"
                    " although load cases press along it; check the sensor's channel and the map",
                    axis=name,
                    size=f"{_DEAD * size:.2g}",
                )
            )


def _zero_loads(readings: Readings) -> Iterator[Suspicion]:
    """Yield load cases that read no force although the arm deflects as under others."""
    size, deflection = np.linalg.norm(readings.force, axis=1), readings.deflection
    for case in dict.fromkeys(readings.load_case.tolist()):
        own = readings.load_case == case
        if float(size[own].max()) < _DEAD * float(np.median(size)) and median_norm(
            deflection[own]
        ) > _BENT * median_norm(deflection):
            yield Suspicion(
                phrase(
                    "no force is read in load case {case}, where the arm deflects by {deflection}"
                    " mm: zeroed in contact? Zero the sensor in the air, before each pose",
                    case=repr(case),
                    deflection=f"{1e3 * median_norm(deflection[own]):.2f}",
                ),
                certain=True,
            )


def _dead_markers(readings: Readings) -> Iterator[Suspicion]:
    """Yield axes along which the tracker sees next to nothing of what the controller moves."""
    told = np.median(np.abs(readings.controller_displacement), axis=0)
    seen = np.median(np.abs(readings.marker_displacement), axis=0)
    moves = told > _MOVED * np.linalg.norm(told)
    dead = moves & (seen < _DEAD * told)
    for axis in np.flatnonzero(dead).tolist():
        yield Suspicion(
            phrase(
                "marker_displacement_{axis} is dead, or in metres or inches in a column of mm:"
                " {seen} mm, where the controller moved by {told} mm (median); check the tracker's"
                " column",
                axis=AXES[axis],
                seen=f"{1e3 * seen[axis]:.2g}",
                told=f"{1e3 * told[axis]:.2g}",
            )
        )


def _repeated(readings: Readings) -> Iterator[Suspicion]:
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
        yield Suspicion(
            phrase(
                "readings of pose {poses} are the same to the last digit under different load"
                " cases: a copied row, or a stream that stood still; leave them out (--exclude)",
                poses=", ".join(map(str, poses)),
            )
        )


def _rounded(readings: Readings) -> Iterator[Suspicion]:
    """Yield that displacements are rounded to a step that is large beside the deflection."""
    size = median_norm(readings.deflection)
    values = np.concatenate([readings.marker_displacement, readings.controller_displacement])
    for step in _STEPS:
        steps = values / step
        if np.abs(steps - np.round(steps)).max() < 1e-3 and step > _GRAIN * size:
            yield Suspicion(
                phrase(
                    "displacements are rounded to {step} mm, {part} of the median deflection:"
                    " export more digits",
                    step=f"{1e3 * step:g}",
                    part=f"{step / size:.0%}",
                )
            )
            return
