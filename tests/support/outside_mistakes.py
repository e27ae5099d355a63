"""Mistakes that an outsider made after the detectors were finished: none was thought of there.

See `support.mistakes`, whose makers they use.
"""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.elastic import ElasticModel, bearing
from elastocal.identification import build, solve
from support.campaigns import Made
from support.further_mistakes import half_of_the_poses, one_off
from support.mistakes import (
    Damage,
    Mistake,
    axes,
    by_cases,
    changed,
    controller,
    forces,
    joints,
    marker,
    order,
    picked,
    rows,
    zero_off,
)


def size_of(made: Made) -> float:
    """Return the median force, in N."""
    return float(np.median(np.linalg.norm(made.readings.force, axis=1)))


def tool_turned_by(made: Made, turn: np.ndarray) -> Made:
    """Return forces that came to base by other orientations of the tool, shape (reading, 3, 3)."""
    own = np.einsum("rji,rj->ri", axes(made, "tcp"), made.readings.force)
    return changed(made, force=np.einsum("rij,rj->ri", turn, own))


def angles_in_another_order(made: Made) -> Made:
    """Return forces whose A, B, C were turned about x, y, z in place of z, y, x."""
    angles = Rotation.from_matrix(axes(made, "tcp")).as_euler("ZYX")
    return tool_turned_by(made, Rotation.from_euler("XYZ", angles).as_matrix())


def inverse_turn(made: Made) -> Made:
    return tool_turned_by(made, np.swapaxes(axes(made, "tcp"), 1, 2))


def turn_of_first_pose(made: Made) -> Made:
    return tool_turned_by(made, np.broadcast_to(axes(made, "tcp")[0], axes(made, "tcp").shape))


def turn_of_pose_before(made: Made) -> Made:
    turn = by_cases(made, axes(made, "tcp").reshape(-1, 9))
    return tool_turned_by(made, np.roll(turn, 1, axis=0).reshape(-1, 3, 3))


def sorted_as_text(values: np.ndarray) -> np.ndarray:
    """Return values whose poses came in the order 0, 1, 10, 11, …, 2, 20."""
    return values[sorted(range(len(values)), key=str)]


def there_and_back(values: np.ndarray) -> np.ndarray:
    """Return values whose load cases were written backwards at every second pose."""
    values = values.copy()
    values[1::2] = values[1::2, ::-1]
    return values


def row_lost(values: np.ndarray) -> np.ndarray:
    """Return values of which one is missing half way: all later ones stand one row too early."""
    flat = values.reshape(-1, values.shape[-1])
    half = len(flat) // 2
    kept = np.concatenate([flat[:half], flat[half + 1 :], flat[-1:]])
    return kept.reshape(values.shape)


def stood_still(values: np.ndarray) -> np.ndarray:
    """Return values of which every fourth is the one before: a tracker that lost its target."""
    flat = values.reshape(-1, values.shape[-1]).copy()
    flat[3::4] = flat[2::4][: len(flat[3::4])]
    return flat.reshape(values.shape)


def of_next(part: float):
    """Return rows that hold a part of the next load case: time stamps that run ahead."""

    def change(values: np.ndarray) -> np.ndarray:
        early = values.copy()
        early[:, :-1] = (1.0 - part) * values[:, :-1] + part * values[:, 1:]
        return early

    return change


def in_each_pose(name: str, *size: float) -> Damage:
    """Return a drift that begins anew at the reference of each pose, in m or N."""

    def change(values: np.ndarray) -> np.ndarray:
        course = np.linspace(0.0, 1.0, values.shape[1] + 1)[1:]
        return values + course[:, None] * np.array(size)

    return rows(name, change)


def force_grows_in_each_pose(made: Made) -> Made:
    return in_each_pose("force", 0.0, 0.0, 0.3 * size_of(made))(made)


def warms_up(made: Made) -> Made:
    """Return forces whose zero moves by 40 % in the first quarter and stays there."""
    course = 1.0 - np.exp(-order(made) / 0.1)
    direction = axes(made, "tcp") @ (0.4 * size_of(made) * np.array([0.2, 0.3, 0.9]))
    return changed(made, force=made.readings.force + course[:, None] * direction)


def another_payload(made: Made) -> Made:
    """Return a tool's weight that is taken off twice from half way on."""
    late = (order(made) > 0.5)[:, None]
    heavier = np.array([0.0, 0.0, 0.35 * size_of(made)])
    return changed(made, force=made.readings.force + late * heavier)


def preloaded(values: np.ndarray) -> np.ndarray:
    """Return values counted from a reference that was read under 30 % of the first press."""
    return values - 0.3 * values[:, :1]


def marker_preloaded(made: Made) -> Made:
    """Return a marker whose reference was read under a part of the first press."""
    bent = by_cases(made, made.readings.deflection)
    first = np.broadcast_to(0.3 * bent[:, :1], bent.shape).reshape(-1, 3)
    return changed(made, marker_displacement=made.readings.marker_displacement - first)


def loose(late: bool) -> Damage:
    """Return a tool that slips by 0.4 mm with the force across it."""

    def make(made: Made) -> Made:
        R = axes(made, "tcp")
        own = np.einsum("rji,rj->ri", R, made.readings.force)
        slip = 0.4e-3 * np.sign(own) * (np.abs(own) > 0.2 * size_of(made)) * [1.0, 1.0, 0.0]
        part = (order(made) > 0.5)[:, None] if late else 1.0
        moved = part * np.einsum("rij,rj->ri", R, slip)
        return changed(made, marker_displacement=made.readings.marker_displacement + moved)

    return make


def another_marker(late: bool) -> Damage:
    """Return what a marker 0.3 m beside showed, as springs that fit the campaign bend the tool."""

    def make(made: Made) -> Made:
        r, robot = made.readings, made.robot
        model = ElasticModel(robot, bearing(robot))
        beside = made.marker + np.array([0.2, -0.2, 0.1])
        here, there = (build(model, r, None, each) for each in (made.marker, beside))
        bent = (there.O - here.O) @ solve(here).compliance
        turned = axes(made, "tcp") - robot.forward(r.reference_joint_position)[:, :3, :3]
        more = bent + turned @ (beside - made.marker)
        part = (order(made) > 0.5)[:, None] if late else 1.0
        return changed(made, marker_displacement=r.marker_displacement + part * more)

    return make


def in_tcp_frame(made: Made) -> Made:
    own = np.einsum("rji,rj->ri", axes(made, "tcp"), made.readings.marker_displacement)
    return changed(made, marker_displacement=own)


def part_in_inches(made: Made) -> Made:
    """Return a third file of four whose markers are in inches."""
    t = order(made)
    there = ((t > 0.5) & (t < 0.75))[:, None]
    m = made.readings.marker_displacement
    return changed(made, marker_displacement=np.where(there, m / 25.4, m))


def without_comma(made: Made) -> Made:
    """Return marker displacements of which every twelfth in z lost its decimal comma."""
    m = made.readings.marker_displacement.copy()
    m[5::12, 2] *= 10.0
    return changed(made, marker_displacement=m)


def copied_case(made: Made) -> Made:
    """Return a load case whose rows were copied from another one, all columns."""
    for name in ("force", "marker_displacement", "controller_displacement", "joint_position"):
        made = rows(name, _third_of_second)(made)
    return made


def _third_of_second(values: np.ndarray) -> np.ndarray:
    values = values.copy()
    values[:, -1] = values[:, -2]
    return values


def some_reversed(made: Made) -> Made:
    """Return forces of every fourth pose with the other sign."""

    def change(values: np.ndarray) -> np.ndarray:
        values = values.copy()
        values[::4] *= -1.0
        return values

    return rows("force", change)(made)


def cross_talk(own: np.ndarray) -> np.ndarray:
    return own + own[:, 2:] * np.array([0.25, -0.15, 0.0])


def compressed(own: np.ndarray) -> np.ndarray:
    """Return forces of a sensor that reads the less the more presses on it."""
    size = np.linalg.norm(own, axis=1, keepdims=True)
    return own * (1.0 - 0.35 * size / max(size.max(), 1.0))


def dead_band(own: np.ndarray) -> np.ndarray:
    band = 0.2 * np.median(np.linalg.norm(own, axis=1))
    return np.sign(own) * np.maximum(np.abs(own) - band, 0.0)


def weight_as_if_upright(made: Made) -> Made:
    """Return forces whose tool's weight was taken off along the tool's axis."""
    W = made.tool_weight
    down = -axes(made, "tcp")[:, :, 2] * W
    return changed(made, force=made.readings.force + down + np.array([0.0, 0.0, -W]))


def rail_elsewhere(made: Made) -> Made:
    """Return a rail that was recorded at the pose before."""

    def change(values: np.ndarray) -> np.ndarray:
        values = values.copy()
        outside = made.robot.external_axes
        values[..., :outside] = np.roll(values[..., :outside], 1, axis=0)
        return values

    for name in ("joint_position", "reference_joint_position"):
        made = rows(name, change)(made)
    return made


def remastered(made: Made) -> Made:
    """Return joints 2, 3 and 5 whose zeros were set anew half way, with the controller's tcp."""
    late = (order(made) > 0.5)[:, None]
    off = np.radians([0.0, 4.0, -5.0, 0.0, 6.0, 0.0])

    def change(q: np.ndarray) -> np.ndarray:
        return q + late * off

    return joints(change, computed=True)(made)


def marker_turns(made: Made) -> Made:
    """Return a tracker whose base turned by 10 deg over the campaign as the hall grew warm."""
    turn = Rotation.from_rotvec(np.radians(10.0) * order(made)[:, None] * np.array([0.3, 0.1, 0.9]))
    return changed(made, marker_displacement=turn.apply(made.readings.marker_displacement.copy()))


def tool_of_another_angle(made: Made) -> Made:
    """Return forces of a sensor that is tilted by 15 deg, as on the wedge of another tool."""
    return forces(lambda own: own @ Rotation.from_euler("x", 15, degrees=True).as_matrix(), "tcp")(
        made
    )


def marker_of_other_tool(made: Made) -> Made:
    return replace(made, marker=made.marker[[1, 0, 2]] * np.array([1.0, -1.0, 1.0]) + [0.1, 0.1, 0])


ROW = ("row", "load case", "pose")
TURN = ("turned by", "orientation", "mixed up", "frame")
OUTSIDE = (
    Mistake("orientation angles in another order", angles_in_another_order, TURN),
    Mistake("forces turned by the inverse orientation", inverse_turn, TURN),
    Mistake("forces turned by the orientation of the first pose", turn_of_first_pose, TURN),
    Mistake("forces turned by the orientation of the pose before", turn_of_pose_before, ROW),
    Mistake("sensor tilted by 15 deg about x", tool_of_another_angle, ("turned", "tilted")),
    Mistake("forces with poses sorted as text", rows("force", sorted_as_text), ROW),
    Mistake("markers with poses sorted as text", rows("marker_displacement", sorted_as_text), ROW),
    Mistake("joints with poses sorted as text", rows("joint_position", sorted_as_text), ROW),
    Mistake("forces written there and back", rows("force", there_and_back), ROW),
    Mistake("markers written there and back", rows("marker_displacement", there_and_back), ROW),
    Mistake("a row of the forces lost half way", rows("force", row_lost), ROW),
    Mistake("a row of the markers lost half way", rows("marker_displacement", row_lost), ROW),
    Mistake(
        "every fourth marker is the one before",
        rows("marker_displacement", stood_still),
        ("the same", "row", "stood still"),
    ),
    Mistake("forces 30 % of the next load case", rows("force", of_next(0.3)), ("run ahead",)),
    Mistake(
        "markers drift by 0.5 mm in each pose",
        in_each_pose("marker_displacement", 0.3e-3, -0.3e-3, 0.27e-3),
        ("drift", "reference"),
    ),
    Mistake(
        "zero of the force drifts by 30 % in each pose",
        force_grows_in_each_pose,
        ("drift", "zero of the force"),
    ),
    Mistake("sensor warms up, 40 %", warms_up, ("drift", "zeroed", "constant")),
    Mistake(
        "another payload from half way on",
        another_payload,
        ("weight", "jump", "drift", "from pose"),
    ),
    Mistake(
        "forces counted from a preload",
        rows("force", preloaded),
        ("zeroed in contact", "zeroed at the wrong"),
    ),
    Mistake("markers counted from a preload", marker_preloaded, ("reference", "preload")),
    Mistake("tool slips by 0.4 mm", loose(False), ("loose", "slip", "friction", "backlash")),
    Mistake(
        "tool slips by 0.4 mm from half way on",
        loose(True),
        ("loose", "slip", "friction", "backlash", "from pose"),
    ),
    Mistake("another marker 0.3 m beside", another_marker(False), ("marker seems to sit",)),
    Mistake("another marker from half way on", another_marker(True), ("from pose", "marker seems")),
    Mistake("markers in the tcp frame", in_tcp_frame, ("frame",)),
    Mistake("a file of markers in inches", part_in_inches, ("inch", "too", "from pose")),
    Mistake("decimal commas lost in marker_z", without_comma, ("set aside", "suspicious")),
    Mistake("a load case copied from another", copied_case, ("the same",)),
    Mistake("forces of every fourth pose reversed", some_reversed, ("reversed", "sign", "aside")),
    Mistake("cross-talk of 25 % from force_z", forces(cross_talk, "tcp"), ("turned", "cross-talk")),
    Mistake("sensor compressed by 35 %", forces(compressed, "tcp"), ("range", "linear")),
    Mistake("dead band of 20 %", forces(dead_band, "tcp"), ("dead", "linear")),
    Mistake(
        "weight taken off as if upright", weight_as_if_upright, ("weight", "zeroed", "constant")
    ),
    Mistake("rail of the pose before", rail_elsewhere, ("rail", "pose", "rows")),
    Mistake("zeros set anew half way, tcp computed", remastered, ("zero", "joint", "from pose")),
    Mistake("sixth joint in degrees", joints(one_off(5, 57.29578)), ("6", "wrist_3", "degrees")),
    Mistake("third joint 2 % too long", joints(one_off(2, 1.02)), ("3", "elbow")),
    Mistake("zero of the fifth joint off by 5 deg", joints(zero_off(4, 5.0)), ("5", "wrist_2")),
    Mistake(
        "zero of the second joint off by 5 deg, tcp computed",
        joints(zero_off(1, 5.0), True),
        ("2", "lift"),
    ),
    Mistake("tracker's base turns by 10 deg", marker_turns, ("drift", "turn", "from pose")),
    Mistake("marker of another tool", marker_of_other_tool, ("marker seems to sit",)),
    Mistake(
        "marker_x from half way on reversed",
        half_of_the_poses(marker(lambda m: m * [-1.0, 1.0, 1.0])),
        ("from pose",),
    ),
    Mistake(
        "controller_y and controller_z swapped",
        controller(picked(0, 2, 1)),
        ("controller_displacement",),
    ),
)
