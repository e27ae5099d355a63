"""Checks of readings without a fit: contradictions; constant, repeated and rounded columns.

Forces and deflections are compared with a rule of thumb for the arm.

A gear winds up by some 2 mrad under the permissible torque of its joint. That torque is the URDF's;
otherwise it follows from the weight of the arm or its reach. A fit may be softer or stiffer than
the rule by a factor of two or three, and the loads of a campaign may be small; a wrong unit of the
force causes both at once (docs/decisions/0105-mistakes-undone.md).
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elastocal.arrays import BoolArray, FloatArray, are_multiples
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, actuated
from elastocal.findings import Finding, Grade, Kind, as_number
from elastocal.identification.mistakes._motion import AXES, MM, contradictions, median_norm
from elastocal.robot import Robot
from elastocal.wording import one_of, phrase

WIND_UP = 2e-3
"""Angle by which a gear is assumed to wind up under the permissible torque of its joint, in rad:
makers of gears for robots state 1 to 3 mrad."""
DRIVE = 4e7
"""Stiffness of a linear drive, in N/m."""
_TORQUES = np.array([1.0, 1.0, 0.8, 0.26, 0.26, 0.16])
"""Torque that each joint of an arm of six axes may use over that of its second."""
_RATIO, _RATIO_SPREAD = np.log(1.3), np.log(2.0)
"""Logarithm of the measured deflection over the rule's, and its spread over arms."""
_SHARE, _SHARE_SPREAD = np.log(0.2), np.log(2.2)
"""The same of the part of its torques that a campaign loads an arm with."""
_TOO_MUCH, _FAR_TOO_MUCH = 1.5, 10.0
"""Share of its torques that no arm carries: of those of its URDF, and by a rule of thumb."""
_LIKELIER = 3.5
"""Increase of twice the log-likelihood from which a wrong unit is suspected."""
_FORCE_UNITS = (
    ("lbf", np.log(4.4482216)),
    ("kgf (daN)", np.log(9.80665)),
    ("kN", np.log(1e3)),
)
_WEIGHTS = 1.6
_REACHES = 40.0
"""In N·m per m to the fifth."""
_SHORTEST, _LONGEST = 1.4, 3.6
"""Reach of the arms for which this holds, in m."""


UNIT_OF_FORCE = Kind(
    "mistakes.unit-of-force",
    "forces look like {unit} in a column of N: they load the arm with {share} of"
    " its torques, and it seems {times} times as compliant as the rule of thumb for"
    " such arms; check the unit of the sensor",
    shown={"unit": one_of, "share": as_number(".1%"), "times": as_number(".2g")},
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
    """Yield units in which forces or displacements would have the usual size of arms.

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
        yield UNIT_OF_FORCE(unit=likeliest, share=share, times=ratio)
        return
    if share > (_TOO_MUCH if _states_torques(robot) else _FAR_TOO_MUCH):
        yield COUNTS(share=share)
        return
    for word, k in (
        (phrase("inches in a column of mm"), np.log(25.4)),
        (phrase("mm in a column of inches"), -np.log(25.4)),
    ):
        gain = (r**2 - (r + k) ** 2) / _RATIO_SPREAD**2
        if gain > _LIKELIER and k > 0.0 and share > _TOO_MUCH:
            # Forces that are too large make an arm look as stiff, and load it besides.
            yield COUNTS(share=share)
        elif gain > _LIKELIER:
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
    softness = 1.0 / np.where(turning, torque / WIND_UP, DRIVE)
    rule = median_norm(model.observation_blocks(*loads, marker_offset) @ softness)
    used = np.abs(model.load_torques(*loads)) / torque
    share = float(np.median(used[:, turning].max(axis=1)))
    deflection = median_norm(readings.deflection)
    if not (rule > 0.0 and share > 0.0 and deflection > 0.0):
        return None
    return deflection / rule, share


def usual_torques(robot: Robot) -> FloatArray | None:
    """Return the torque that each joint may use, shape (joint,), in N·m; None where none is known.

    As the URDF says it; else 1.6 times the largest torque of the arm's own weight about its second
    joint, which is what 17 arms of the catalogue have within 1.1 to 2.7; else by the reach to its
    fifth power, which holds for arms of 1.4 to 3.6 m: nothing is known of others.
    """
    first, count = robot.external_axes, len(robot.joint_names)
    arm = robot.limits.effort[first:]
    if len(arm) != len(_TORQUES):
        return None
    if not _states_torques(robot):
        shoulder = _shoulder_torque(robot)
        if shoulder is None:
            return None
        arm = _TORQUES * shoulder
    torque = np.full(count, np.inf)
    torque[first:] = arm
    return torque


def _states_torques(robot: Robot) -> bool:
    """Return whether the URDF states the torque of each joint of the arm."""
    return bool(np.isfinite(robot.limits.effort[robot.external_axes :]).all())


def _shoulder_torque(robot: Robot) -> float | None:
    """Return the torque that the second joint of an arm may use, in N·m; None if unknown."""
    first = robot.external_axes
    if robot.has_masses:
        turns = np.linspace(-np.pi, np.pi, 13)
        q = np.zeros((len(turns) ** 2, len(robot.joint_names)))
        q[:, first + 1], q[:, first + 2] = (each.ravel() for each in np.meshgrid(turns, turns))
        held = float(np.abs(robot.gravity_torques(q)[:, first + 1]).max())
        if held > 0.0:
            return _WEIGHTS * held
    lengths = [np.linalg.norm(each.placement[:3, 3]) for each in robot.chain.joints[first + 1 :]]
    reach = float(sum(lengths))
    return _REACHES * reach**5 if _SHORTEST <= reach <= _LONGEST else None


_DEAD = 5e-3
"""Part of what is usual below which an axis is dead: noise of an instrument is larger."""
_MOVED = 0.1
"""Part of the motion from which an axis has one that the tracker must see."""
_BENT = 0.3
"""Part of the median deflection that no arm has without a force."""
_PRESSED_ALONG = (("north", "south"), ("east", "west"), ("normal",))
"""Load cases that press along each axis of the tcp (docs/conventions.md)."""
_STEPS = (1e-3, 1e-4, 1e-5)
_OF_A_STEP = 1e-3
"""Part of a step by which rounded values miss its multiples."""
_GRAIN = 0.05
"""Part of the median deflection that a step of rounding may have."""


def find_implausible(
    robot: Robot, readings: Readings, marker_offset: ArrayLike | None = None
) -> tuple[Finding, ...]:
    """Return the mistakes that readings show without a fit.

    Parameters
    ----------
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
    found += [*_clipped(robot, readings), *_dead_bands(robot, readings)]
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
CLIPPED = Kind(
    "mistakes.clipped-forces",
    "{what} stops at {size} N: {count} of {total} readings are as large to within 0.01 %, and no"
    " smaller force is so common; is the sensor at the end of its range? Press with less, or take"
    " a sensor with a larger range",
    shown={"size": as_number(".0f")},
)
DEAD_BAND = Kind(
    "mistakes.dead-band",
    "force_{axis} in the {frame} frame is exactly zero in {count} of {total} readings, where a"
    " sensor has noise: does a dead band drop or lessen small forces? Switch it off in the sensor"
    " or controller",
)
ROUNDED = Kind(
    "mistakes.rounded-displacements",
    "displacements are rounded to {step} mm, {part} of the median deflection: export more digits",
    shown={"step": as_number("g", 1e3), "part": as_number(".0%")},
)


_EXACTLY = 1e-9
"""Part of the largest force below which an axis reads exactly zero."""
_FEWEST_ZEROS = 5


def _dead_bands(robot: Robot, readings: Readings) -> Iterator[Finding]:
    """Yield that an axis of the force is exactly zero where others, and other readings, are not.

    A sensor has noise: zeros are made by who drops or shrinks small forces. What no sensor measured
    (weights, forces that were asked for) is the same in each load case, a load cell of one axis
    reads one axis at a time, and values of few digits are multiples of the smallest.
    """
    largest = float(np.abs(readings.force).max(initial=0.0))
    for name, X in sensor_frames(robot, readings.joint_position).items():
        own = np.einsum("rji,rj->ri", X, readings.force)
        zero = np.abs(own) < _EXACTLY * largest
        count, several = zero.sum(axis=0), np.count_nonzero(~zero, axis=1) > 1
        of_band = (count >= _FEWEST_ZEROS) & (count < len(own)) & (zero & several[:, None]).any(0)
        for axis in np.flatnonzero(of_band).tolist():
            rest, case = own[~zero[:, axis], axis], readings.load_case[~zero[:, axis]]
            is_rounded = are_multiples(rest, float(np.abs(rest).min()), _OF_A_STEP)
            if not is_rounded and _varies(rest[:, None], case, _TIED * largest):
                yield DEAD_BAND(axis=AXES[axis], frame=name, count=int(count[axis]), total=len(own))
                return


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


_PARALLEL = 0.02
"""Largest element by which axes of parallel frames differ."""


def sensor_frames(robot: Robot, q: FloatArray) -> dict[str, FloatArray]:
    """Return the axes of the frames that a force sensor may have, in base.

    Parameters
    ----------
    q : ndarray, shape (reading, joint)
        Joints, in rad or m.

    Returns
    -------
    dict of str to ndarray, shape (reading, 3, 3)
        By the name of the frame; the last link only where its axes are not along those of the tcp.
    """
    R = robot.forward(q)[:, :3, :3]
    last = robot.chain.T_last_tip[:3, :3]
    found = {"tcp": R, "base": np.broadcast_to(np.eye(3), R.shape)}
    # Axes that lie along those of the tcp, in whatever order, are among its other readings.
    if not np.allclose(np.abs(last).max(axis=0), 1.0, atol=_PARALLEL):
        found["last link"] = R @ last.T
    return found


_TIED = 1e-4
"""Part of the largest force within which readings are equally large."""
_FEWEST_TIED = 5
_OFTENER = 4
"""Times that so many readings are equally large at the end of a range as at any smaller force;
2 at most on 200 correct campaigns."""


def _clipped(robot: Robot, readings: Readings) -> Iterator[Finding]:
    """Yield that forces end at a size that many readings have, along an axis or altogether."""
    frames = sensor_frames(robot, readings.joint_position)
    own = {name: np.einsum("rji,rj->ri", X, readings.force) for name, X in frames.items()}
    sizes = {
        phrase("force_{axis} in the {frame} frame", axis=letter, frame=name): np.abs(
            values[:, axis]
        )
        for name, values in own.items()
        for axis, letter in enumerate(AXES)
    }
    sizes[phrase("the force")] = np.linalg.norm(readings.force, axis=1)
    tied = {what: _tied_at_end(each) for what, each in sizes.items()}
    what = max(tied, key=lambda each: np.count_nonzero(tied[each]))
    at_end, largest, case = tied[what], float(sizes[what].max()), readings.load_case
    if not at_end.any():
        return
    # Weights, and forces that were asked for, are the same in each load case by their nature.
    least = _TIED * largest
    if not at_end.all() and not _varies(sizes[what][~at_end, None], case[~at_end], least):
        return
    if all(_varies(each[at_end], case[at_end], least) for each in (own["tcp"], readings.force)):
        count = np.count_nonzero(at_end)
        yield CLIPPED(what=what, size=largest, count=count, total=len(readings))


def _tied_at_end(sizes: FloatArray) -> BoolArray:
    """Return which sizes are the largest; none where as many share a smaller one."""
    tied = sizes >= (1.0 - _TIED) * sizes.max()
    smaller = np.sort(sizes[~tied])
    upper = np.searchsorted(smaller, smaller + _TIED * sizes.max(), side="right")
    most = int((upper - np.arange(len(smaller))).max(initial=1))
    return np.asarray(tied & (np.count_nonzero(tied) >= max(_FEWEST_TIED, _OFTENER * most)))


def _varies(values: FloatArray, case: NDArray[np.str_], least: float) -> bool:
    """Return whether values, shape (reading, n), of any load case differ by more than that."""
    return any(np.ptp(values[case == each], axis=0).max() > least for each in np.unique(case))


def _dead_markers(readings: Readings) -> Iterator[Finding]:
    """Yield axes along which the tracker sees next to nothing of what the controller moves."""
    if readings.by_contact.all():
        return
    told = np.median(np.abs(readings.controller_displacement), axis=0)
    seen = np.median(np.abs(readings.marker_displacement), axis=0)
    moves = told > _MOVED * np.linalg.norm(told)
    dead = moves & (seen < _DEAD * told)
    for axis in np.flatnonzero(dead).tolist():
        yield DEAD_MARKER(axis=AXES[axis], seen=float(seen[axis]), told=float(told[axis]))


def _repeated(readings: Readings) -> Iterator[Finding]:
    """Yield poses at which several load cases read exactly the same."""
    # Presses on one and on two disks may read one force, and where no tracker measured no marker.
    held = readings.by_contact[:, None]
    seen = np.where(held, readings.controller_displacement, readings.marker_displacement)
    rows = np.column_stack([readings.force, seen])
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
        if step > _GRAIN * size and are_multiples(values, step, _OF_A_STEP):
            yield ROUNDED(step=step, part=step / size)
            return
