"""Displacements in the readings: between a reference and a loaded state of the arm.

Both displacements of a reading count from a reference that was read some millimetres away, so
their difference is not the deflection at the loaded joints alone: the arm's own weight bends it
differently at the two. With the sag ``S c`` (`ElasticModel.sag_blocks`) a reading shows

    d = (O(q, f) + S(q) - S(q_0) - O(q_0, f_0)) c

at loaded joints ``q`` and reference joints ``q_0``, the last term where the reference itself was
loaded. A controller that takes the sag out of the positions that it reports shows less of it:
`elastocal.identification.sag_share`. Friction has a memory: its elements are evaluated over the
loads at the pose, in time order, starting from the state that a free motion leaves.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray, IndexArray
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, ModelPosture
from elastocal.identification.contact import counts_from_other_stack
from elastocal.robot import Robot

_SHIFT = 2e-3
"""Half the difference of two places of the tip by which a derivative is taken, in m."""

_ROUNDS = 3
"""Newton steps to the reference; each squares the error of some millimetres."""
_DAMPING = 1e-9
"""Levenberg's damping over the mean square of the Jacobian's entries: a wrist in line stays."""
_ARM_JOINTS = 6


def displacement_blocks(
    model: ElasticModel, readings: Readings, marker_offset: ArrayLike | None = None
) -> FloatArray:
    """Return the rows that times ``c`` are what each reading shows as its deflection.

    Parameters
    ----------
    model : ElasticModel
        Robot and springs.
    readings : Readings
        With joints in the robot's order.
    marker_offset : array_like, shape (3,), optional
        Marker in the tcp frame, in m; see `ElasticModel.observation_blocks`.

    Returns
    -------
    ndarray, shape (reading, 3, parameter)
        In m per unit of each parameter.
    """
    return _of_points(Between.of(model, readings).of_point, readings, marker_offset)


def sag_blocks_between(
    model: ElasticModel, readings: Readings, marker_offset: ArrayLike | None = None
) -> FloatArray:
    """Return the part of `displacement_blocks` that is sag; arguments and shape as there."""
    q, q_0 = model.at(readings.joint_position), model.at(reference_joints(model.robot, readings))

    def of_point(offset: ArrayLike | None) -> FloatArray:
        return model.sag_blocks(q, offset) - model.sag_blocks(q_0, offset)

    return _of_points(of_point, readings, marker_offset)


def _of_points(
    of_point: Callable[[ArrayLike | None], FloatArray],
    readings: Readings,
    marker_offset: ArrayLike | None,
) -> FloatArray:
    """Return the rows of the point whose displacement each reading states."""
    if readings.contacts is None or marker_offset is None:
        return of_point(marker_offset)
    # What the tooling holds is the tcp, not the marker.
    held = readings.by_contact[:, None, None]
    return np.where(held, of_point(None), of_point(marker_offset))


@dataclass(frozen=True, eq=False)
class Between:
    """A model at the loaded and at the reference joints of readings; each is evaluated once."""

    readings: Readings
    loaded: ModelPosture
    reference: ModelPosture
    friction: tuple[FloatArray, FloatArray] | None
    """See `friction_states`; None without friction."""

    @classmethod
    def of(cls, model: ElasticModel, readings: Readings) -> "Between":
        """Return the model at the joints of readings, in the robot's order."""
        q = model.at(readings.joint_position)
        q_0 = model.at(reference_joints(model.robot, readings))
        friction = friction_states(model, readings, q, q_0) if len(model.friction) else None
        return cls(readings, q, q_0, friction)

    def of_point(self, offset: ArrayLike | None) -> FloatArray:
        """Return the rows of the displacement of a point in the tcp frame."""
        model = self.loaded.model

        def blocks(
            at: ModelPosture, force: FloatArray, moment: FloatArray | None, f: FloatArray | None
        ) -> FloatArray:
            return model.observation_blocks(at, force, moment, offset, f)

        return self._difference(blocks, lambda at: model.sag_blocks(at, offset))

    def of_joints(self) -> FloatArray:
        """Return the rows of what joints yield, shape (reading, joint, parameter)."""
        model = self.loaded.model
        return self._difference(model.joint_blocks, model.joint_sag_blocks)

    def of_joints_at_reference(self) -> FloatArray:
        """Return the rows of what the load at the reference yields, (reading, joint, parameter)."""
        reference = None if self.friction is None else self.friction[1]
        return self.loaded.model.joint_blocks(self.reference, self._light(), None, reference)

    def _light(self) -> FloatArray:
        light = self.readings.reference_force
        return np.zeros_like(self.readings.force) if light is None else light

    def _difference(
        self,
        blocks: Callable[
            [ModelPosture, FloatArray, FloatArray | None, FloatArray | None], FloatArray
        ],
        sag: Callable[[ModelPosture], FloatArray],
    ) -> FloatArray:
        readings, (loaded, reference) = self.readings, self.friction or (None, None)
        rows = blocks(self.loaded, readings.force, readings.moment, loaded)
        rows = rows + sag(self.loaded) - sag(self.reference)
        if readings.reference_force is None and reference is None:
            return rows
        return rows - blocks(self.reference, self._light(), None, reference)


def reference_joints(robot: Robot, readings: Readings) -> FloatArray:
    """Return the joints of the zero of both displacements, shape (reading, joint), in rad or m.

    They are those recorded; otherwise, and for presses on more disks than the pose began with,
    those where the controller displacement began, with constant orientation and external axes at
    rest.
    """
    if readings.reference_joint_position is not None:
        q_0, anew = readings.reference_joint_position, counts_from_other_stack(readings)
        if not anew.any():
            return q_0
        q_0 = q_0.copy()
        q_0[anew] = _where_displacement_began(robot, readings)[anew]
        return q_0
    return _where_displacement_began(robot, readings)


def with_references(robot: Robot, readings: Readings) -> Readings:
    """Return readings that hold their `reference_joints`, so that each is sought only once."""
    return replace(readings, reference_joint_position=reference_joints(robot, readings))


def _where_displacement_began(robot: Robot, readings: Readings) -> FloatArray:
    q = readings.joint_position.copy()
    here = robot.forward(q)
    goal = here[:, :3, 3] - readings.controller_displacement
    moving = slice(max(0, q.shape[1] - _ARM_JOINTS), None)
    for _ in range(_ROUNDS):
        now, J = robot.forward(q), robot.jacobian(q)
        turn = np.cross(now[:, :3, :3], here[:, :3, :3], axis=1).sum(axis=2) / 2.0
        error = np.concatenate([goal - now[:, :3, 3], turn], axis=1)
        jacobian = np.concatenate([J.translation, J.rotation], axis=1)[:, :, moving]
        transposed = jacobian.swapaxes(1, 2)
        damping = _DAMPING * float(np.mean(np.square(jacobian))) * np.eye(6)
        pull = np.linalg.solve(jacobian @ transposed + damping, error[..., None])
        q[:, moving] += (transposed @ pull)[..., 0]
    return q


def friction_states(
    model: ElasticModel, readings: Readings, loaded_at: ModelPosture, reference_at: ModelPosture
) -> tuple[FloatArray, FloatArray]:
    """Return the torques of each friction element under load, and at the reading of the zero.

    Parameters
    ----------
    model : ElasticModel
        Robot and springs.
    readings : Readings
        Those of a pose, with what else pressed there (`Readings.also_pressed`), are taken to be
        all that the arm felt. A press of which no force is known (aborted, missing) is not among
        them: friction remembers the readings after it wrongly, until a larger one.
    loaded_at, reference_at : ModelPosture, shape (reading, joint)
        The model at the readings' joints, and at their `reference_joints`.

    Returns
    -------
    loaded : ndarray, shape (reading, element)
    reference : ndarray, shape (reading, element)
        In N·m.
    """
    rest = np.zeros((len(readings), 3))
    lightly = rest if readings.reference_force is None else readings.reference_force
    total = model.load_torques(loaded_at, readings.force, readings.moment) + loaded_at.weight
    others = readings.also_pressed
    if others is not None:
        at = model.at(others.joint_position)
        torque = model.load_torques(at, others.force, others.moment) + at.weight
        total = np.concatenate([total, torque])
    free = reference_at.weight
    zero = model.load_torques(reference_at, lightly) + free
    loaded = np.zeros((len(readings), len(model.friction)))
    reference = np.zeros_like(loaded)
    for steps in _visits(readings):
        is_reading = steps < len(readings)
        rows = steps[is_reading]
        first = rows[:1]
        if readings.conditioned:
            # Free, pressed, then lightly loaded: there the zero was read.
            way = [free[first], total[steps[:1]], zero[first], total[steps[1:]]]
            states = model.friction.path(np.concatenate(way))
            pressed, reference[rows] = np.delete(states[1:], 1, axis=0), states[2]
        else:
            states = model.friction.path(np.concatenate([free[first], zero[first], total[steps]]))
            pressed, reference[rows] = states[2:], states[1]
        loaded[rows] = pressed[is_reading]
    return loaded, reference


def _visits(readings: Readings) -> Iterator[IndexArray]:
    """Yield what was pressed at each pose, in order in time: readings, and behind them others."""
    pose = readings.pose
    order = np.arange(len(readings)) if readings.sequence is None else readings.sequence
    if readings.also_pressed is not None:
        pose = np.concatenate([pose, readings.also_pressed.pose])
        order = np.concatenate([order, readings.also_pressed.sequence])
    for each in np.unique(readings.pose):
        rows = np.flatnonzero(pose == each)
        yield rows[np.argsort(order[rows], kind="stable")]


def slopes_by_shift(displacement: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Return how a displacement changes with a shift of the tip along each axis of the tcp.

    Parameters
    ----------
    displacement : callable
        Returns the displacement at a shift, shape (row, 3), in m.

    Returns
    -------
    ndarray, shape (row, 3, 3)
        In m per m, the axis of the shift last.
    """
    steps = _SHIFT * np.eye(3)
    changes = [displacement(step) - displacement(-step) for step in steps]
    return np.stack(changes, axis=-1) / (2.0 * _SHIFT)
