"""Mistakes of shop floors on which no threshold was chosen: they hold the detectors to account.

See `support.mistakes`, whose makers they use.
"""

from dataclasses import replace

import numpy as np

from support.campaigns import Made
from support.mistakes import (
    Mistake,
    about,
    about_z,
    another_tcp,
    axes,
    bias,
    bumped,
    changed,
    controller,
    forces,
    joints,
    marker,
    order,
    picked,
    rows,
    times,
)


def held(part: float):
    """Return rows that hold a part of what belongs to the row before: read before it settled."""

    def change(values: np.ndarray) -> np.ndarray:
        late = values.copy()
        late[:, 1:] = (1.0 - part) * values[:, 1:] + part * values[:, :-1]
        return late

    return change


def zeroed_once(made: Made) -> Made:
    """Return a campaign whose sensor was zeroed at the first pose only: weight turns with it."""
    R = axes(made, "tcp")
    weight = np.array([0.0, 0.0, -made.tool_weight])
    zero = R @ (R[0].T @ weight)
    return changed(made, force=made.readings.force + weight - zero)


def station_moved_for_a_while(made: Made) -> Made:
    count = len(made.readings)
    hit = (np.arange(count) > count / 3) & (np.arange(count) < 2 * count / 3)
    shift = hit[:, None] * np.array([0.8e-3, -0.4e-3, 0.5e-3])
    return changed(made, marker_displacement=made.readings.marker_displacement + shift)


def other_base(angle: float, axis: tuple[float, float, float]):
    """Return a campaign whose controller, tracker and sensor speak of another base frame."""
    turn = about(axis, angle)

    def make(made: Made) -> Made:
        return controller(turn)(marker(turn)(forces(turn)(made)))

    return make


def increments(made: Made) -> Made:
    """Return displacements of the marker counted from the load case before."""

    def change(values: np.ndarray) -> np.ndarray:
        return np.concatenate([values[:, :1], np.diff(values, axis=1)], axis=1)

    return rows("marker_displacement", change)(made)


def reduced(made: Made) -> Made:
    """Return the deflection in the column of the marker's displacement."""
    return changed(made, marker_displacement=made.readings.deflection)


def poses_exchanged(made: Made) -> Made:
    def change(values: np.ndarray) -> np.ndarray:
        order = np.arange(len(values))
        order[: len(order) // 2 * 2] = order[: len(order) // 2 * 2].reshape(-1, 2)[:, ::-1].ravel()
        return values[order]

    return rows("force", change)(made)


def saturated(made: Made) -> Made:
    """Return forces along the tool's axis that end at seven tenths of their largest."""

    def change(own: np.ndarray) -> np.ndarray:
        limit = 0.7 * np.abs(own[:, 2]).max()
        return np.column_stack([own[:, :2], np.clip(own[:, 2], -limit, limit)])

    R = axes(made, "tcp")
    own = np.einsum("rji,rj->ri", R, made.readings.force)
    return changed(made, force=np.einsum("rij,rj->ri", R, change(own)))


def clipped(frame: str):
    """Return a mistake of a sensor whose range ends at eight tenths of the largest force."""

    def make(made: Made) -> Made:
        R, force = axes(made, frame), made.readings.force
        own = np.einsum("rji,rj->ri", R, force)
        limit = 0.8 * np.abs(own).max()
        return changed(made, force=np.einsum("rij,rj->ri", R, np.clip(own, -limit, limit)))

    return make


def shortened(made: Made) -> Made:
    """Return forces that are no longer than eight tenths of the longest."""
    size = np.linalg.norm(made.readings.force, axis=1)
    factor = np.minimum(1.0, 0.8 * size.max() / size)
    return changed(made, force=made.readings.force * factor[:, None])


def upright_drift(made: Made) -> Made:
    """Return forces whose zero drifts along z of base, as that of a sensor under the part."""
    size = 0.3 * np.median(np.linalg.norm(made.readings.force, axis=1))
    return changed(
        made, force=made.readings.force + size * order(made)[:, None] * np.array([0.0, 0.0, 1.0])
    )


def zeroed_at_first_press(made: Made) -> Made:
    return changed(made, force=made.readings.force - made.readings.force[0])


def two_poses(values: np.ndarray) -> np.ndarray:
    """Return values, shape (pose, load case, column), with two poses exchanged."""
    values = values.copy()
    values[[4, -3]] = values[[-3, 4]]
    return values


def of_two_poses(made: Made) -> Made:
    """Return joints, of the reference too, that stand in each other's rows."""
    for name in ("joint_position", "reference_joint_position"):
        made = rows(name, two_poses)(made)
    return made


def loaded_from_third_pose(made: Made) -> Made:
    """Return a second joint that reads 2 deg more under load from the third pose on."""

    def change(values: np.ndarray) -> np.ndarray:
        values = values.copy()
        values[2:, :, made.robot.external_axes + 1] += np.radians(2.0)
        return values

    return rows("joint_position", change)(made)


def off_along_z(made: Made) -> Made:
    return replace(made, marker=made.marker + np.array([0.0, 0.0, 0.15]))


def one_off(joint: int, gain: float):
    def change(q: np.ndarray) -> np.ndarray:
        q[:, joint] *= gain
        return q

    return change


def stuck(joint: int):
    def change(q: np.ndarray) -> np.ndarray:
        q[:, joint] = q[0, joint]
        return q

    return change


def zero_of(joint: int, angle: float):
    return lambda q: q + np.radians(angle) * np.eye(6)[joint]


def half_of_the_poses(damage):
    """Return a mistake that begins half way: a plug changed in the break."""

    def make(made: Made) -> Made:
        late = (np.arange(len(made.readings)) >= len(made.readings) // 2)[:, None]
        bad = damage(made).readings
        return changed(
            made,
            force=np.where(late, bad.force, made.readings.force),
            marker_displacement=np.where(
                late, bad.marker_displacement, made.readings.marker_displacement
            ),
        )

    return make


def marker_lever(factor: float):
    return lambda made: replace(made, marker=factor * made.marker)


def force_pose_missing(made: Made) -> Made:
    def change(values: np.ndarray) -> np.ndarray:
        values = values.copy()
        values[4] = 0.0
        return values

    return rows("force", change)(made)


def absolute(values: np.ndarray) -> np.ndarray:
    return np.abs(values)


def noisy(made: Made) -> Made:
    """Return readings of a marker that is loose: noise of a third of the deflection."""
    rng = np.random.default_rng(0)
    size = np.median(np.linalg.norm(made.readings.deflection, axis=1)) / 3.0
    noise = size * rng.normal(size=made.readings.marker_displacement.shape)
    return changed(made, marker_displacement=made.readings.marker_displacement + noise)


def later_rows(count: int):
    return lambda values: np.roll(values.reshape(-1, values.shape[-1]), count, axis=0).reshape(
        values.shape
    )


FORCE = ("force", "sensor")
PART = ("from pose",)
"""What names a mistake that begins half way."""
FURTHER = (
    Mistake("force axes x, y, z read as y, z, x", forces(picked(1, 2, 0), "tcp"), FORCE),
    Mistake("force axes x, y, z read as z, x, y", forces(picked(2, 0, 1), "tcp"), FORCE),
    Mistake(
        "force_x and force_z swapped", forces(picked(2, 1, 0), "tcp"), ("force_x and force_z",)
    ),
    Mistake("force_x and force_y reversed", forces(times(-1, -1, 1), "tcp"), ("180",)),
    Mistake("force_y and force_z reversed", forces(times(1, -1, -1), "tcp"), ("180",)),
    Mistake(
        "force turned by 45 deg about the tool", forces(about_z(45), "tcp"), ("turned by -45",)
    ),
    Mistake("force turned by 20 deg about the tool", forces(about_z(20), "tcp"), ("turned by",)),
    Mistake(
        "sensor mounted upside down, turned by 90 deg",
        forces(lambda f: about_z(90)(f * np.array([1.0, -1.0, -1.0])), "tcp"),
        FORCE,
    ),
    Mistake("gain of force_z 50 % high", forces(times(1, 1, 1.5), "tcp"), ("force_z",)),
    Mistake("gain of force_x 40 % low", forces(times(0.6, 1, 1), "tcp"), ("force_x",)),
    Mistake("force_x in lbf", forces(times(1 / 4.448, 1, 1), "tcp"), ("force_x",)),
    Mistake("force_y in kgf", forces(times(1, 1 / 9.807, 1), "tcp"), ("force_y",)),
    Mistake("force_z in lbf", forces(times(1, 1, 1 / 4.448), "tcp"), ("force_z",)),
    Mistake("forces without their signs", forces(absolute, "tcp"), FORCE),
    Mistake("force_z saturated", saturated, FORCE),
    Mistake("forces read before they settled", rows("force", held(0.3)), ("lag", "settle", "late")),
    Mistake(
        "markers read before they settled",
        rows("marker_displacement", held(0.3)),
        ("lag", "settle", "late"),
    ),
    Mistake("forces of two rows before", rows("force", later_rows(2)), ("row",)),
    Mistake("markers of two rows before", rows("marker_displacement", later_rows(2)), ("row",)),
    Mistake("forces of the next row", rows("force", later_rows(-1)), ("row",)),
    Mistake("forces of neighbouring poses exchanged", poses_exchanged, ("pose", "row")),
    Mistake("forces of one pose missing", force_pose_missing, ("set aside", "force", "pose")),
    Mistake("sensor zeroed only once", zeroed_once, ("zero", "weight")),
    Mistake("zero of the force off by 15 %", bias(0.05, 0.08, -0.12), ("zeroed at the wrong",)),
    Mistake(
        "force_x reversed from half way on",
        half_of_the_poses(forces(times(-1, 1, 1), "tcp")),
        PART,
    ),
    Mistake(
        "sensor turned by 90 deg from half way on",
        half_of_the_poses(forces(about_z(90), "tcp")),
        PART,
    ),
    Mistake("forces in lbf from half way on", half_of_the_poses(forces(lambda f: f / 4.448)), PART),
    Mistake("marker_y dead", marker(times(1, 0, 1)), ("marker_displacement_y",)),
    Mistake("marker_z 30 % too small", marker(times(1, 1, 0.7)), ("marker_displacement_z",)),
    Mistake("marker_x 10 % too large", marker(times(1.1, 1, 1)), ("marker_displacement_x",)),
    Mistake("marker 10 % too small", marker(lambda x: 0.9 * x), ("marker displacements look",)),
    Mistake("marker axes x, y, z read as y, z, x", marker(picked(1, 2, 0)), ("turned", "marker")),
    Mistake("marker_x and marker_z swapped", marker(picked(2, 1, 0)), ("marker_displacement_x",)),
    Mistake("marker_x and marker_y reversed", marker(times(-1, -1, 1)), ("180",)),
    Mistake("marker reversed", marker(lambda x: -x), ("mirrored", "-x, -y, -z")),
    Mistake("tracker frame turned by 5 deg", marker(about((0.2, 1, 0.4), 5)), ("turned by",)),
    Mistake("marker counted from the load case before", increments, ("load case", "counted")),
    Mistake("deflection in the marker's column", reduced, ("deflection", "exchanged", "missing")),
    Mistake("station moved in the middle third", station_moved_for_a_while, ("bumped", "station")),
    Mistake("station bumped half way, 0.5 mm", bumped(0.0, 0.5e-3), ("bumped",)),
    Mistake("loose marker", noisy, ("unexplained", "marker", "scatter")),
    Mistake(
        "controller displacement in inches",
        controller(lambda x: x / 25.4),
        ("controller_displacement is in inches",),
    ),
    Mistake(
        "controller displacement in metres",
        controller(lambda x: x / 1e3),
        ("controller_displacement",),
    ),
    Mistake(
        "controller displacement in the tcp frame",
        lambda m: changed(
            m,
            controller_displacement=np.einsum(
                "rji,rj->ri", axes(m, "tcp"), m.readings.controller_displacement
            ),
        ),
        ("tcp frame",),
    ),
    Mistake(
        "controller_x and controller_y swapped",
        controller(picked(1, 0, 2)),
        ("controller_displacement",),
    ),
    Mistake("controller_z dead", controller(times(1, 1, 0)), ("controller_displacement",)),
    Mistake(
        "controller displacement of the row before",
        rows("controller_displacement", later_rows(1)),
        ("controller", "row"),
    ),
    Mistake("all of another base, turned by 90 deg", other_base(90, (0, 0, 1)), ("base",)),
    Mistake("all of another base, upside down", other_base(180, (1, 0, 0)), ("base",)),
    Mistake("second joint reversed", joints(times(1, -1, 1, 1, 1, 1)), ("2", "lift")),
    Mistake("fifth joint reversed", joints(times(1, 1, 1, 1, -1, 1)), ("5", "wrist_2")),
    Mistake("joints 2 and 3 exchanged", joints(picked(0, 2, 1, 3, 4, 5)), ("exchanged", "order")),
    Mistake("third joint half its size", joints(one_off(2, 0.5)), ("3", "elbow")),
    Mistake("second joint in degrees", joints(one_off(1, 57.29578)), ("2", "lift", "degrees")),
    Mistake("fourth joint stands still", joints(stuck(3)), ("4", "wrist_1")),
    Mistake("zero of the second joint off by 10 deg", joints(zero_of(1, 10.0)), ("2", "lift")),
    Mistake("zero of the first joint off by 30 deg", joints(zero_of(0, 30.0)), ("1", "pan")),
    Mistake("zero of the third joint off by 3 deg", joints(zero_of(2, 3.0)), ("3", "elbow")),
    Mistake(
        "joints of the pose before",
        rows("joint_position", lambda v: np.roll(v, 1, axis=0)),
        ("row", "pose"),
    ),
    Mistake("tcp at the flange", another_tcp(0.0, 0.0, -0.2), ("tcp",)),
    Mistake("tcp 50 mm aside", another_tcp(0.05, 0.0, 0.0), ("tcp",)),
    Mistake("marker offset in inches", marker_lever(1 / 25.4), ("marker",)),
    Mistake("marker offset reversed", marker_lever(-1.0), ("marker",)),
    Mistake("forces clipped at 80 % of the largest", shortened, ("the end of its range",)),
    Mistake("force axes of tcp clipped at 80 %", clipped("tcp"), ("the end of its range",)),
    Mistake("force axes of base clipped at 80 %", clipped("base"), ("the end of its range",)),
    Mistake("drift of the force zero by 30 % of base", upright_drift, ("force drifts",)),
    Mistake(
        "zero of the force taken in the first press",
        zeroed_at_first_press,
        ("zeroed at the wrong", "zeroed in contact"),
    ),
    Mistake(
        "joints of two poses exchanged", rows("joint_position", two_poses), ("joints of poses",)
    ),
    Mistake("joints and references of two poses exchanged", of_two_poses, ("joints of poses",)),
    Mistake(
        "second joint 2 deg off under load from the third pose on",
        loaded_from_third_pose,
        ("a2 reads", "lift_joint reads"),
    ),
    Mistake("marker 150 mm off along z", off_along_z, ("marker seems to sit",)),
)
