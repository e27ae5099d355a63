"""Common mistakes of shop floors, made in sound readings: nothing here knows how they are found.

Each takes a sound campaign and returns what somebody who made the mistake would hand in. Arrays of
readings are cut into (pose, load case, axis); numbers are chosen, not drawn, so that a table of
them is the same everywhere.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from elastocal.robot import Robot, with_tool
from support.campaigns import Made

Damage = Callable[[Made], Made]


@dataclass(frozen=True)
class Mistake:
    """A mistake, and words by which a message names it rightly."""

    name: str
    make: Damage
    named: tuple[str, ...]
    """Any of these, in a refusal or a warning, names it."""


def changed(made: Made, **changes: object) -> Made:
    return replace(made, readings=replace(made.readings, **changes))


def axes(made: Made, frame: str) -> np.ndarray:
    """Return the axes of a frame in base at each reading, shape (reading, 3, 3)."""
    count = len(made.readings)
    if frame == "base":
        return np.broadcast_to(np.eye(3), (count, 3, 3))
    R = made.robot.forward(made.readings.joint_position)[:, :3, :3]
    return R if frame == "tcp" else R @ made.robot.chain.T_last_tip[:3, :3].T


def by_cases(made: Made, array: np.ndarray) -> np.ndarray:
    """Return an array of readings as (pose, load case, column)."""
    return array.reshape(len(np.unique(made.readings.pose)), -1, array.shape[-1])


def order(made: Made) -> np.ndarray:
    """Return the place of each reading in time, from 0 to 1."""
    return np.linspace(0.0, 1.0, len(made.readings))


def forces(change: Callable[[np.ndarray], np.ndarray], frame: str = "base") -> Damage:
    """Return a mistake in all forces, as they read in a frame."""

    def make(made: Made) -> Made:
        R, r = axes(made, frame), made.readings
        light = r.reference_force
        return changed(
            made,
            force=_in_frame(change, R, r.force),
            reference_force=None if light is None else _in_frame(change, R, light),
        )

    return make


def _in_frame(change: Callable, R: np.ndarray, force: np.ndarray) -> np.ndarray:
    own = np.einsum("rji,rj->ri", R, force)
    return np.einsum("rij,rj->ri", R, change(own))


def times(*gains: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda values: values * np.array(gains)


def picked(*columns: int) -> Callable[[np.ndarray], np.ndarray]:
    return lambda values: values[..., list(columns)]


def about_z(angle: float) -> Callable[[np.ndarray], np.ndarray]:
    return about((0.0, 0.0, 1.0), angle)


def about(axis: tuple[float, float, float], angle: float) -> Callable[[np.ndarray], np.ndarray]:
    k, a = np.array(axis) / np.linalg.norm(axis), np.radians(angle)
    K = np.cross(np.eye(3), k)
    R = np.eye(3) - np.sin(a) * K + (1.0 - np.cos(a)) * K @ K
    return lambda values: values @ R.T


def marker(change: Callable[[np.ndarray], np.ndarray]) -> Damage:
    return lambda made: changed(made, marker_displacement=change(made.readings.marker_displacement))


def controller(change: Callable[[np.ndarray], np.ndarray]) -> Damage:
    return lambda made: changed(
        made, controller_displacement=change(made.readings.controller_displacement)
    )


def both(change: Callable[[np.ndarray], np.ndarray]) -> Damage:
    return lambda made: marker(change)(controller(change)(made))


def joints(change: Callable[[np.ndarray], np.ndarray], computed: bool = False) -> Damage:
    """Return a mistake in the arm's six joints, rail apart.

    Parameters
    ----------
    change : callable
        What becomes of joints, shape (reading, 6).
    computed : bool
        Whether the controller displacement is computed from these joints, as without a controller
        that says where its tcp is.
    """

    def make(made: Made) -> Made:
        r, outside = made.readings, made.robot.external_axes
        first = _arm(change, r.joint_position, outside)
        zero = r.reference_joint_position
        before = None if zero is None else _arm(change, zero, outside)
        wrong = changed(made, joint_position=first, reference_joint_position=before)
        if not computed or before is None:
            return wrong
        moved = _marker_at(made, first) - _marker_at(made, before)
        return changed(wrong, controller_displacement=moved)

    return make


def _arm(change: Callable, q: np.ndarray, outside: int) -> np.ndarray:
    return np.concatenate([q[:, :outside], change(q[:, outside:].copy())], axis=1)


def _marker_at(made: Made, q: np.ndarray) -> np.ndarray:
    T = made.robot.forward(q)
    return T[:, :3, 3] + T[:, :3, :3] @ made.marker


def one_reversed(joint: int) -> Callable[[np.ndarray], np.ndarray]:
    return times(*[-1.0 if each == joint else 1.0 for each in range(6)])


def zero_off(joint: int, angle: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda q: q + np.radians(angle) * np.eye(6)[joint]


def coupled(sign: float) -> Callable[[np.ndarray], np.ndarray]:
    def change(q: np.ndarray) -> np.ndarray:
        q[:, 2] = sign * (q[:, 1] + q[:, 2])
        return q

    return change


def rows(name: str, change: Callable[[np.ndarray], np.ndarray]) -> Damage:
    """Return a mistake in the order of rows of some columns, as (pose, load case, column)."""

    def make(made: Made) -> Made:
        values = getattr(made.readings, name)
        return changed(made, **{name: change(by_cases(made, values)).reshape(values.shape)})

    return make


def exchanged(made: Made, one: str, other: str) -> Made:
    """Return a campaign whose forces of two load cases are exchanged."""
    cases = made.readings.load_case.tolist()
    width = len(by_cases(made, made.readings.force)[0])
    index = np.arange(width)
    a, b = cases[:width].index(one), cases[:width].index(other)
    index[[a, b]] = index[[b, a]]
    return rows("force", lambda values: values[:, index])(made)


def delayed(values: np.ndarray) -> np.ndarray:
    """Return rows each of which holds what belongs to the one before."""
    flat = values.reshape(-1, values.shape[-1])
    return np.concatenate([flat[:1], flat[:-1]]).reshape(values.shape)


def next_case(values: np.ndarray) -> np.ndarray:
    return np.roll(values, 1, axis=1)


def weight(times_weight: float) -> Damage:
    return lambda made: changed(
        made, force=made.readings.force + np.array([0.0, 0.0, -times_weight * made.tool_weight])
    )


def bias(*part: float) -> Damage:
    """Return a constant in the tcp frame, in parts of the median force."""

    def make(made: Made) -> Made:
        size = np.median(np.linalg.norm(made.readings.force, axis=1))
        return changed(
            made, force=made.readings.force + axes(made, "tcp") @ (size * np.array(part))
        )

    return make


def zeroed_in_contact(made: Made) -> Made:
    def change(values: np.ndarray) -> np.ndarray:
        return values - values[:, :1]

    return rows("force", change)(made)


def marker_drift(size: float) -> Damage:
    direction = np.array([0.6, -0.64, 0.48])
    return lambda made: changed(
        made,
        marker_displacement=made.readings.marker_displacement
        + size * order(made)[:, None] * direction,
    )


def force_drift(part: float) -> Damage:
    def make(made: Made) -> Made:
        size = part * np.median(np.linalg.norm(made.readings.force, axis=1))
        drift = order(made)[:, None] * (axes(made, "tcp") @ (size * np.array([0.5, 0.3, 0.8])))
        return changed(made, force=made.readings.force + drift)

    return make


def bumped(turn: float, shift: float) -> Damage:
    """Return a campaign whose station was bumped half way: turned in degrees, shifted in m."""

    def make(made: Made) -> Made:
        late = (order(made) > 0.5)[:, None]
        moved = about((0.3, 0.2, 1.0), turn)(made.readings.marker_displacement)
        moved = moved + shift * np.array([0.7, 0.1, -0.7])
        marker_displacement = np.where(late, moved, made.readings.marker_displacement)
        return changed(made, marker_displacement=marker_displacement)

    return make


def rail_times(gain: float) -> Damage:
    def make(made: Made) -> Made:
        outside = made.robot.external_axes
        scale = np.where(np.arange(len(made.robot.joint_names)) < outside, gain, 1.0)
        r = made.readings
        zero = r.reference_joint_position
        return changed(
            made,
            joint_position=r.joint_position * scale,
            reference_joint_position=None if zero is None else zero * scale,
        )

    return make


def another_tcp(*shift: float) -> Damage:
    def make(made: Made) -> Made:
        T = np.eye(4)
        T[:3, 3] = shift
        urdf = with_tool(made.robot.urdf, made.robot.tip, "moved_tcp", T)
        # The marker stays where it is.
        return replace(
            made, robot=Robot.from_urdf(urdf, "moved_tcp"), marker=made.marker - np.array(shift)
        )

    return make


def another_robot(made: Made) -> Made:
    """Return the campaign with a sibling of longer links in place of the arm."""
    return replace(made, robot=_stretched(made.robot, 1.2))


def _stretched(robot: Robot, scale: float) -> Robot:
    """Return an arm whose forearm and upper arm are longer by a factor."""
    names = robot.joint_names[robot.external_axes :]
    urdf = robot.urdf
    for name in names[2:4]:
        pattern = re.compile(rf'(<joint name="{name}".*?<origin xyz=")([^"]+)(")', re.S)
        numbers = pattern.search(urdf)
        assert numbers is not None, name
        longer = " ".join(repr(scale * float(part)) for part in numbers[2].split())
        urdf = pattern.sub(rf"\g<1>{longer}\g<3>", urdf, count=1)
    return Robot.from_urdf(urdf, robot.tip)


def rounded(step: float) -> Damage:
    return both(lambda values: step * np.round(values / step))


def with_outliers(part: float) -> Damage:
    def make(made: Made) -> Made:
        values = made.readings.marker_displacement.copy()
        hit = np.arange(3, len(values), round(1.0 / part))
        values[hit] += 0.004 * np.array([1.0, -1.0, 0.5])
        return changed(made, marker_displacement=values)

    return make


def one_pose_frozen(made: Made) -> Made:
    def change(values: np.ndarray) -> np.ndarray:
        values = values.copy()
        values[3] = values[3, :1]
        return values

    for name in ("marker_displacement", "controller_displacement", "force", "joint_position"):
        made = rows(name, change)(made)
    return made


def duplicated(made: Made) -> Made:
    def change(values: np.ndarray) -> np.ndarray:
        values = values.copy()
        values[2] = values[1]
        return values

    for name in (
        "marker_displacement",
        "controller_displacement",
        "force",
        "joint_position",
        "reference_joint_position",
    ):
        made = rows(name, change)(made)
    return made


def commanded(made: Made) -> Made:
    """Return the campaign with the forces that were asked for in place of those measured."""
    R = axes(made, "tcp")
    own = by_cases(made, np.einsum("rji,rj->ri", R, made.readings.force))
    asked = np.broadcast_to(np.round(np.median(own, axis=0), -1), own.shape).reshape(-1, 3)
    return changed(made, force=np.einsum("rij,rj->ri", R, asked))


def no_marker_offset(made: Made) -> Made:
    return replace(made, marker=np.zeros(3))


INCH, POUND, KILOPOND = 0.0254, 4.4482216, 9.80665
MISTAKES = (
    Mistake("force in kgf", forces(lambda f: f / KILOPOND), ("kgf",)),
    Mistake("force in lbf", forces(lambda f: f / POUND), ("lbf",)),
    Mistake("force in kN", forces(lambda f: f / 1e3), ("kn",)),
    Mistake("force in daN", forces(lambda f: f / 10.0), ("dan",)),
    Mistake("force in counts", forces(lambda f: f * 1e6), ("counts", "finite", "mN")),
    Mistake("force in counts of 1/16 N", forces(lambda f: f * 16.0), ("counts",)),
    Mistake("gain of force_x 30 % high", forces(times(1.3, 1, 1), "tcp"), ("force_x",)),
    Mistake("gain of force_z 30 % low", forces(times(1, 1, 0.7), "tcp"), ("force_z",)),
    Mistake("gain of force_y 10 % high", forces(times(1, 1.1, 1), "tcp"), ("force_y",)),
    Mistake("gain of all forces 30 % high", forces(times(1.3, 1.3, 1.3)), ("gain",)),
    Mistake("force_x dead", forces(times(0, 1, 1), "tcp"), ("force_x",)),
    Mistake("force_y dead", forces(times(1, 0, 1), "tcp"), ("force_y",)),
    Mistake("force_z dead", forces(times(1, 1, 0), "tcp"), ("force_z",)),
    Mistake("force_x reversed", forces(times(-1, 1, 1), "tcp"), ("force_x",)),
    Mistake("force_y reversed", forces(times(1, -1, 1), "tcp"), ("force_y",)),
    Mistake("force_z reversed", forces(times(1, 1, -1), "tcp"), ("force_z",)),
    Mistake("force_z of base reversed", forces(times(1, 1, -1)), ("force_z",)),
    Mistake(
        "force_x and force_y swapped", forces(picked(1, 0, 2), "tcp"), ("force_x and force_y",)
    ),
    Mistake(
        "force_y and force_z swapped", forces(picked(0, 2, 1), "tcp"), ("force_y and force_z",)
    ),
    Mistake(
        "force_x and force_y of base swapped", forces(picked(1, 0, 2)), ("force_x and force_y",)
    ),
    Mistake(
        "force turned by 90 deg about the tool",
        forces(about_z(90), "tcp"),
        ("turned by -90", "turned by 90"),
    ),
    Mistake(
        "force turned by 180 deg about the tool", forces(about_z(180), "tcp"), ("turned by 180",)
    ),
    Mistake("force turned by 30 deg about the tool", forces(about_z(30), "tcp"), ("turned by",)),
    Mistake(
        "sensor frame called base",
        lambda m: changed(m, force=np.einsum("rji,rj->ri", axes(m, "tcp"), m.readings.force)),
        ("tcp frame", "sensor (last link) frame"),
    ),
    Mistake("sign of all forces", forces(lambda f: -f), ("sign turned",)),
    Mistake("weight of the tool left in", weight(1.0), ("tool weight",)),
    Mistake("weight of the tool subtracted twice", weight(-1.0), ("tool weight",)),
    Mistake(
        "zero of the force taken in contact",
        zeroed_in_contact,
        ("zeroed in contact", "zeroed at the wrong"),
    ),
    Mistake("zero of the force off by 30 %", bias(0.1, -0.15, 0.25), ("zeroed at the wrong",)),
    Mistake("marker_x dead", marker(times(0, 1, 1)), ("marker_displacement_x",)),
    Mistake("marker_z dead", marker(times(1, 1, 0)), ("marker_displacement_z",)),
    Mistake("marker_y reversed", marker(times(1, -1, 1)), ("marker_displacement_y",)),
    Mistake("marker_z reversed", marker(times(1, 1, -1)), ("marker_displacement_z",)),
    Mistake("marker_z in metres", marker(times(1, 1, 1e-3)), ("marker_displacement_z",)),
    Mistake("marker_x in inches", marker(times(1 / 25.4, 1, 1)), ("marker_displacement_x",)),
    Mistake("marker in inches", marker(lambda x: x / 25.4), ("inch",)),
    Mistake("marker in metres", marker(lambda x: x / 1e3), ("metres", "mm")),
    Mistake("both displacements in inches", both(lambda x: x / 25.4), ("inch",)),
    Mistake(
        "marker_x and marker_y swapped",
        marker(picked(1, 0, 2)),
        ("marker_displacement_x and marker_displacement_y",),
    ),
    Mistake(
        "marker_y and marker_z swapped",
        marker(picked(0, 2, 1)),
        ("marker_displacement_y and marker_displacement_z",),
    ),
    Mistake(
        "tracker frame left-handed",
        marker(lambda x: about((0.2, 0.5, 1), 70)(about((0.2, 0.5, 1), -70)(x) * [1, -1, 1])),
        ("left-handed", "mirrored"),
    ),
    Mistake("tracker frame called base, turned by 90 deg", marker(about_z(90)), ("turned by",)),
    Mistake(
        "tracker frame called base, turned by 40 deg",
        marker(about((0.3, 0.1, 1), 40)),
        ("turned by",),
    ),
    Mistake(
        "controller displacement missing",
        controller(lambda x: 0.0 * x),
        ("controller_displacement",),
    ),
    Mistake(
        "controller displacement reversed", controller(lambda x: -x), ("controller_displacement",)
    ),
    Mistake(
        "displacements exchanged",
        lambda m: changed(
            m,
            marker_displacement=m.readings.controller_displacement,
            controller_displacement=m.readings.marker_displacement,
        ),
        ("sign turned", "exchanged"),
    ),
    Mistake("joints in degrees", joints(np.degrees), ("degrees",)),
    Mistake(
        "first joint reversed", joints(one_reversed(0)), ("joint 1", "joint_a1", "shoulder_pan")
    ),
    Mistake("fourth joint reversed", joints(one_reversed(3)), ("joint 4", "joint_a4", "wrist_1")),
    Mistake("sixth joint reversed", joints(one_reversed(5)), ("joint 6", "joint_a6", "wrist_3")),
    Mistake(
        "first joint reversed, controller displacement computed",
        joints(one_reversed(0), True),
        ("joint 1", "joint_a1", "shoulder_pan"),
    ),
    Mistake("joints 1, 4, 6 reversed", joints(times(-1, 1, 1, -1, 1, -1)), ("1, 4 and 6",)),
    Mistake("third joint coupled", joints(coupled(-1.0)), ("coupled", "horizontal")),
    Mistake("third joint from the horizontal", joints(coupled(1.0)), ("coupled", "horizontal")),
    Mistake("joints 4 and 6 exchanged", joints(picked(0, 1, 2, 5, 4, 3)), ("exchanged", "order")),
    Mistake("joints in reverse order", joints(picked(5, 4, 3, 2, 1, 0)), ("order",)),
    Mistake("joints of the row before", rows("joint_position", delayed), ("row before", "rows")),
    Mistake("zero of the second joint off by 90 deg", joints(zero_off(1, 90.0)), ("zero", "90")),
    Mistake("zero of the third joint off by 90 deg", joints(zero_off(2, -90.0)), ("zero", "90")),
    Mistake(
        "zero of the third joint off, controller displacement computed",
        joints(zero_off(2, -90.0), True),
        ("zero", "90"),
    ),
    Mistake("rail in mm", rail_times(1e3), ("mm",)),
    Mistake("rail missing", rail_times(0.0), ("rail",)),
    Mistake(
        "forces of north and south exchanged",
        lambda m: exchanged(m, "north", "south"),
        ("load cases",),
    ),
    Mistake(
        "forces of east and west exchanged", lambda m: exchanged(m, "east", "west"), ("load cases",)
    ),
    Mistake("forces of the next load case", rows("force", next_case), ("load case", "row")),
    Mistake("forces of the row before", rows("force", delayed), ("row",)),
    Mistake("markers of the row before", rows("marker_displacement", delayed), ("row",)),
    Mistake(
        "forces of the pose before", rows("force", lambda v: np.roll(v, 1, axis=0)), ("pose", "row")
    ),
    Mistake("a pose twice", duplicated, ("one configuration",)),
    Mistake("one pose's rows all the same", one_pose_frozen, ("the same",)),
    Mistake("drift of 1 mm", marker_drift(1e-3), ("drift",)),
    Mistake("drift of the force zero by 40 %", force_drift(0.4), ("drift",)),
    Mistake("station bumped half way, 1 mm", bumped(0.0, 1e-3), ("bumped", "drift", "station")),
    Mistake("station bumped half way, 5 deg", bumped(5.0, 0.0), ("bumped", "drift", "station")),
    Mistake("another robot of the family", another_robot, ("another robot",)),
    Mistake("tcp 100 mm off along z", another_tcp(0.0, 0.0, 0.1), ("tcp",)),
    Mistake("tcp of another tool", another_tcp(0.15, 0.05, -0.12), ("tcp",)),
    Mistake("marker offset ignored", no_marker_offset, ("marker",)),
    Mistake("displacements rounded to 0.1 mm", rounded(1e-4), ("rounded",)),
    Mistake("five per cent of outliers", with_outliers(0.05), ("set aside", "suspicious")),
    Mistake("forces asked for in place of measured", commanded, ("asked", "commanded")),
)
