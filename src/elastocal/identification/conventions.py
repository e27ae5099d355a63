"""Check of signs, frames and joints: whether the data belong to this robot as stated.

A force with the wrong sign, in the wrong frame, or joints counted in the wrong direction still give
a solvable system; only the fit is worse. So the usual mistakes are undone one by one, and if the
data are explained far better without one of them, the fit is refused with that message
(docs/decisions/0006-conventions-verdict.md).

A new mistake is a function that undoes it and an entry in `FORCE_MISTAKES`; of the joints, an
entry in `elastocal.robot.other_joint_readings`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from operator import itemgetter

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.errors import ConventionError, DatasetError, IdentificationError
from elastocal.findings import Finding, Kind, as_number
from elastocal.identification.displacement import displacement_blocks, with_references
from elastocal.identification.mistakes import name_joint_mistake, still
from elastocal.identification.options import FitOptions
from elastocal.identification.problem import Problem, build
from elastocal.identification.solve import solve
from elastocal.robot import JointReading, Robot, other_joint_readings

POOR_FIT = 0.35
"""Part of the median deflection that may stay unexplained without a warning."""
LEFT_BY_UNDOING = 0.6
"""A mistake is named when undoing it leaves at most this part of the unexplained deflection. Model
errors and noise remain for correct data, so that undoing a mistake that was not made leaves more,
not less."""
_FITS_WELL = 0.2
"""Largest unexplained part of a mistake's undoing for it to be named: the corrected data must fit
well. Springs missing in the model may let a wrong interpretation of good data fit less badly, but
never well."""
_ROUND_OFF = 1e-8
"""Unexplained part below which data are exact and comparing remainders compares round-off."""
_POOR_WITH_FEW_EQUATIONS = 0.5
"""Unexplained part above which a mistake is named even when there are fewer than four equations a
spring; with so few, another reading may fit better by chance."""

_OUTSIDE = np.radians(5.0)
"""Distance outside a joint limit that cannot be calibration or rounding, in rad (or m)."""
_TCP_WRONG = 0.05
"""Median distance between recorded and computed tcp position that geometry errors and
deflection cannot explain, in m."""
_TCP_OFF = 0.005
"""Distance above which a warning is given, in m."""


def check_conventions(
    model: ElasticModel,
    readings: Readings,
    marker_offset: ArrayLike | None = None,
    options: FitOptions | None = None,
) -> float:
    """Return the part of the median deflection that a robust fit leaves unexplained.

    Parameters
    ----------
    model : ElasticModel
        Robot and springs.
    readings : Readings
        What was measured.
    marker_offset : array_like, shape (3,), optional
        Marker in the tcp frame, in m.
    options : FitOptions, optional
        Their free frames and contact count here, nothing else.

    Raises
    ------
    ConventionError
        If the data are explained far better with a sign or a frame read otherwise.
    IdentificationError
        If most deflections are zero.
    """
    stated_by = options or FitOptions()
    readings = with_references(model.robot, readings)
    plain = FitOptions(free_frame=stated_by.free_frame, contact=stated_by.contact, encoders=False)
    problem = build(model, readings, plain, marker_offset)
    if not np.median(np.linalg.norm(problem.d, axis=1)) > 0.0:
        raise IdentificationError("most deflections are zero: there is nothing to identify")
    robust = solve(problem, "huber")
    stated = _unexplained(problem.reweighted(robust.reading_weight))
    found = []
    for mistake in mistakes_of(model.robot):
        undone = mistake.undo(model.robot, readings)
        blocks = displacement_blocks(model, undone, marker_offset)
        # The weights of the stated reading keep a blunder out of every other one, too.
        other = problem.with_springs(blocks, undone.deflection).reweighted(robust.reading_weight)
        found.append((_unexplained(other), mistake.message))
    best, message = min(found, key=itemgetter(0))
    few = problem.d.size < 4 * problem.columns
    enough = stated > (_POOR_WITH_FEW_EQUATIONS if few else _ROUND_OFF)
    if enough and best <= min(LEFT_BY_UNDOING * stated, _FITS_WELL):
        raise ConventionError(
            f"{message}: read that way the fit leaves {best:.1%} of the median deflection"
            f" unexplained, as stated {stated:.1%}"
        )
    return stated


def _unexplained(problem: Problem) -> float:
    """Return the median residual of a non-negative fit over the median deflection."""
    residual = np.linalg.norm(problem.residuals(solve(problem).compliance), axis=1)
    return float(np.median(residual) / np.median(np.linalg.norm(problem.d, axis=1)))


_Undo = Callable[[Robot, Readings], Readings]


@dataclass(frozen=True)
class ForceMistake:
    """An interpretation of the data that differs from the conventions."""

    message: str
    undo: _Undo
    """Returns the readings as they would be if the mistake had been made."""


def mistakes_of(robot: Robot) -> tuple[ForceMistake, ...]:
    """Return the mistakes that are possible with a robot, the likeliest first."""
    joints = (
        ForceMistake(each.message, _reading_joints(each)) for each in other_joint_readings(robot)
    )
    return (*FORCE_MISTAKES, *joints)


def _turn_force(_: Robot, readings: Readings) -> Readings:
    moment = readings.moment
    return replace(readings, force=-readings.force, moment=None if moment is None else -moment)


def _from_tcp_frame(robot: Robot, readings: Readings) -> Readings:
    return _rotated(readings, robot.forward(readings.joint_position)[:, :3, :3])


def _from_last_link_frame(robot: Robot, readings: Readings) -> Readings:
    R_base_tcp = robot.forward(readings.joint_position)[:, :3, :3]
    return _rotated(readings, R_base_tcp @ robot.chain.T_last_tip[:3, :3].T)


def _rotated(readings: Readings, R: FloatArray) -> Readings:
    moment = readings.moment
    turned = None if moment is None else np.einsum("rij,rj->ri", R, moment)
    force = np.einsum("rij,rj->ri", R, readings.force)
    return replace(readings, force=force, moment=turned)


def _reading_joints(reading: JointReading) -> _Undo:
    def undo(robot: Robot, readings: Readings) -> Readings:
        # Those of the reference are affected, too, and sought again.
        q = reading.read(robot, readings.joint_position)
        return replace(readings, joint_position=q, reference_joint_position=None)

    return undo


def _both(first: _Undo, second: _Undo) -> _Undo:
    return lambda robot, readings: second(robot, first(robot, readings))


FORCE_MISTAKES = (
    ForceMistake(
        "the force (or the displacement) has its sign turned: elastocal takes the force on the"
        " robot, and deflection = marker minus controller displacement",
        _turn_force,
    ),
    ForceMistake("the forces are in the tcp frame, not in base", _from_tcp_frame),
    ForceMistake(
        "the forces are in the tcp frame with their sign turned",
        _both(_from_tcp_frame, _turn_force),
    ),
    ForceMistake(
        "the forces are in the sensor (last link) frame, not in base", _from_last_link_frame
    ),
    ForceMistake(
        "the forces are in the sensor (last link) frame with their sign turned",
        _both(_from_last_link_frame, _turn_force),
    ),
)
"""Mistakes of forces, the likeliest first; those of joints come after them."""


OUTSIDE = Kind(
    "calibration.joint-outside-limits",
    "{joint} at pose {pose} is {position} {unit}, outside the robot's {lower} to {upper} {unit}",
    shown=dict.fromkeys(("position", "lower", "upper"), as_number(".4g")),
)
LIMITS_ASSUMED = Kind("calibration.limits-assumed", "{message} (limits assumed, no source)")
ELSEWHERE = Kind(
    "calibration.tcp-elsewhere",
    "recorded tcp_position is {distance} mm (median) from that of the joints of {name} at {tip}",
    shown={"distance": as_number(".1f", 1e3), "tip": repr},
)


def check_joints(robot: Robot, readings: Readings) -> tuple[Finding, ...]:
    """Return warnings about recorded joints, or refuse them.

    Raises
    ------
    DatasetError
        If a joint lies clearly outside its limits (degrees in a radian column, another joint
        order), or the recorded tcp positions are elsewhere.
    """
    return (*_limits(robot, readings), *_positions(robot, readings))


def _limits(robot: Robot, readings: Readings) -> list[Finding]:
    """Return a warning for each joint that is ever outside its limits, or refuse them."""
    limits, margin = robot.limits, robot.limits.margin(readings.joint_position)
    # Joint by joint: a rail's metres and a wrist's radians have no common worst.
    worst, rows = margin.min(axis=0), margin.argmin(axis=0)
    outside = np.flatnonzero(worst < 0.0).tolist()
    for joint in outside:
        if limits.lower[joint] >= limits.upper[joint]:
            raise DatasetError(
                f"URDF of {robot.name} leaves {robot.joint_names[joint]} no range: its limits are"
                f" {limits.lower[joint]:g} to {limits.upper[joint]:g} {_unit(robot, joint)}"
            )
    found = {joint: _outside(robot, readings, int(rows[joint]), joint) for joint in outside}
    assumed = any(assumption.field == "position" for assumption in robot.assumptions)
    clearly = [message for joint, message in found.items() if worst[joint] < -_OUTSIDE]
    if clearly and not assumed:
        raise DatasetError(f"{'; '.join(clearly)}: degrees, another joint order, or another robot?")
    if not assumed:
        return list(found.values())
    return [LIMITS_ASSUMED(message=message) for message in found.values()]


def _outside(robot: Robot, readings: Readings, reading: int, joint: int) -> Finding:
    limits = robot.limits
    return OUTSIDE(
        joint=robot.joint_names[joint],
        pose=int(readings.pose[reading]),
        position=float(readings.joint_position[reading, joint]),
        unit=_unit(robot, joint),
        lower=float(limits.lower[joint]),
        upper=float(limits.upper[joint]),
    )


def _unit(robot: Robot, joint: int) -> str:
    return "rad" if robot.revolute[joint] else "m"


def _positions(robot: Robot, readings: Readings) -> list[Finding]:
    if readings.tcp_position is None:
        return []
    computed = robot.forward(readings.joint_position)[:, :3, 3]
    recorded = readings.tcp_position + readings.controller_displacement
    distance = np.linalg.norm(computed - recorded, axis=1)
    median = float(np.median(distance))
    message = ELSEWHERE(distance=median, name=robot.name, tip=robot.tip)
    if median > _TCP_WRONG:
        raise DatasetError(f"{message}: {_cause(robot, readings, recorded, median)}")
    return [message] if median > _TCP_OFF else []


def _cause(robot: Robot, readings: Readings, recorded: FloatArray, median: float) -> str:
    """Return the likely reason why recorded positions differ from those of the joints."""

    def left(read: Callable[[FloatArray], FloatArray]) -> float:
        place = robot.forward(read(readings.joint_position))[:, :3, 3]
        return float(np.median(np.linalg.norm(place - recorded, axis=1)))

    enough = min(_TCP_OFF, LEFT_BY_UNDOING * median)
    if named := name_joint_mistake(robot, left, enough):
        return named
    T = robot.forward(readings.joint_position)
    own = np.einsum("rji,rj->ri", T[:, :3, :3], recorded - T[:, :3, 3])
    tcp = np.median(own, axis=0)
    if float(np.median(np.linalg.norm(own - tcp, axis=1))) < enough:
        x, y, z = 1e3 * tcp
        return f"the tcp that the controller uses is ({x:.0f}, {y:.0f}, {z:.0f}) mm from it"
    return (
        "another tcp, joint signs, joint order or base frame?"
        f"{still(robot, readings.joint_position)}"
    )
