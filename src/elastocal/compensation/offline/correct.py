"""Inverse of a deflection: the pose to command so that the loaded tcp is where it was programmed.

With programmed tcp position ``p``, orientation ``R`` and force ``f``, find ``q`` with

    p(q) + C(q) f = p,    R(q) = R,    C(q) = J diag(c) J^T      (paper Eq. 10)

by Newton steps of the rigid arm: ``J_arm dq = [p - p(q) - C(q) f; log(R R(q)^T)]``. The omitted
part of the derivative, ``d(C f)/dq``, is a deflection per metre, some 1e-3, so that each step gains
three digits. Usual practice takes the first step alone; its residual is reported.

Where the geometric errors of the arm are known (`elastocal.geometry`), ``p(q)`` is the position of
its tool without process force, under weight and payload; ``R(q)`` stays the controller's, since
errors of a mrad do not move the tcp.

Rows follow one another in time, and gears with friction keep a memory; a row without load is in the
air and clears it.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.errors import PathError
from elastocal.identification import CalibratedModel, CoveredRows, PredictionDoubt
from elastocal.results import brief_repr
from elastocal.robot import Robot
from elastocal.robot.inverse import (
    InverseKinematics,
    RowName,
    check_limits,
    largest_move,
    pose_error,
    turned_inside,
)

LARGEST_DEFLECTION = 0.02
"""Largest correction, whatever it is made of, in m."""
_TOLERANCE = 1e-9
"""Largest error left in position (m) and orientation (rad); the contract is 1e-7 m."""
_STEPS = 12
_DAMPING = 1e-6
"""Damping of the Newton step, so that a straight wrist does not stop the rows beside it."""
_SMALL_TURN = 1.0
"""Largest step of a joint (rad or m) that still is one of a correction."""
Unloaded = Callable[[FloatArray], FloatArray]
"""True tcp position without process force, as a function of joints, in base, shape (row, 3), in
m."""


@brief_repr
@dataclass(frozen=True, eq=False)
class PathCorrection:
    """Corrected rows."""

    q: FloatArray
    """Joints to command, shape (row, joint), in rad or m."""
    T_base_tcp: FloatArray
    """Poses to command, orientation as programmed, shape (row, 4, 4), in m."""
    deflection: FloatArray
    """Predicted at the corrected row, in base, shape (row, 3), in m."""
    low: FloatArray
    """Lower ends of its 95 % intervals, shape (row, 3), in m."""
    high: FloatArray
    """Upper ends, shape (row, 3), in m."""
    uncorrected: FloatArray
    """Predicted deviation of the tool from its programmed position, shape (row, 3), in m: the
    deflection and, where they are known, the geometric errors of the arm."""
    first_order: FloatArray
    """Distance that one step would leave, predicted, shape (row,), in m."""
    residual: FloatArray
    """Distance that is left, predicted, shape (row,), in m."""
    pulled: BoolArray
    """Whether the force draws the tool out, along +z of the tcp, as no surface can, (row,)."""
    memory: FloatArray
    """State of the friction memory after the last row, shape (element,), in N·m."""
    covered: CoveredRows | None = None
    """Rows that were calibrated; none where the model does not know where that was."""

    @property
    def doubt(self) -> PredictionDoubt | None:
        """Uncertainty of the predictions; None where no row has a load."""
        loaded = self.deflection.any(axis=1)
        return PredictionDoubt.of(
            *(each[loaded] for each in (self.deflection, self.low, self.high))
        )


def correct_rows(  # noqa: PLR0913 (what goes on from block to block is one more)
    solver: InverseKinematics,
    calibrated: CalibratedModel,
    q: FloatArray,
    T_base_tcp: FloatArray,
    wrench: tuple[FloatArray, FloatArray | None],
    where: RowName,
    *,
    may_turn: bool = False,
    largest: float = LARGEST_DEFLECTION,
    memory: FloatArray | None = None,
    unloaded: Unloaded | None = None,
) -> PathCorrection:
    """Return the corrected rows of a path.

    Parameters
    ----------
    solver : InverseKinematics
        Of the arm as its controller knows it, which the path is programmed for: the model's, or
        where that is the arm as built, as drawn. Used where a Newton step fails.
    calibrated : CalibratedModel
        The model.
    q : ndarray, shape (row, joint)
        Programmed joints, in rad or m; external axes stay.
    T_base_tcp : ndarray, shape (row, 4, 4)
        Programmed poses, which ``q`` reaches.
    wrench : tuple of ndarray, shape (row, 3)
        Force and moment on the robot at the tcp in base, in N and N·m; no moment: None.
    where : callable
        Names a row in a refusal.
    may_turn : bool
        Whether a joint that the correction takes over its limit may move by a whole turn: in a path
        of poses the controller chooses the turn, in a path of joints it would rotate.
    largest : float
        Largest deflection that is taken for one, and largest correction, in m.
    memory : ndarray, shape (element,), optional
        What friction remembers of the rows before; by default it is free before the first row.
    unloaded : callable, optional
        Where the arm as built stands; by default where the controller believes.

    Raises
    ------
    PathError
        If a programmed or corrected row is outside the joint limits or out of reach, or would be
        moved farther than the largest correction.
    """
    robot = solver.robot
    check_limits(robot, q, where, "is programmed")
    load = _Load(calibrated, *wrench, memory, unloaded).along(q)
    deflection = load.deflection(q, np.arange(len(q)))
    q, reached = q.copy(), T_base_tcp.copy()
    off = deflection + load.misplaced(q, reached)
    _check_size(off, deflection, largest, where)
    first = uncorrected = off.copy()
    error = _error(reached, off, T_base_tcp)
    for step in range(_STEPS):
        open_rows = np.flatnonzero(~_small(error))
        if not len(open_rows):
            break
        q[open_rows] += _newton_step(robot, q[open_rows], error[open_rows])
        reached[open_rows] = robot.forward(q[open_rows])
        if load.remembers:
            # Friction sees the corrected rows, all of them in their order.
            load, open_rows = load.along(q), np.arange(len(q))
        deflection[open_rows] = load.deflection(q[open_rows], open_rows)
        off[open_rows] = deflection[open_rows] + load.misplaced(q[open_rows], reached[open_rows])
        error[open_rows] = _error(reached[open_rows], off[open_rows], T_base_tcp[open_rows])
        if step == 0:
            first = off.copy()
    for row in np.flatnonzero(~_small(error)).tolist():
        q[row] = _by_solver(solver, load, q_start=q[row], T=T_base_tcp[row], row=row, where=where)
        own = slice(row, row + 1)
        reached[own] = robot.forward(q[own])
        deflection[own] = load.deflection(q[own], np.array([row]))
        off[own] = deflection[own] + load.misplaced(q[own], reached[own])
    if may_turn:
        q = turned_inside(robot, q)
    check_limits(robot, q, where, "would be corrected")
    commanded = T_base_tcp.copy()
    commanded[:, :3, 3] = reached[:, :3, 3]
    _check_size(reached[:, :3, 3] - T_base_tcp[:, :3, 3], deflection, largest, where)
    residual = reached[:, :3, 3] + off - T_base_tcp[:, :3, 3]
    predicted = calibrated.predict(q, *wrench, friction=load.friction_torque)
    return PathCorrection(
        q,
        commanded,
        deflection,
        predicted.low,
        predicted.high,
        uncorrected,
        np.linalg.norm(first - uncorrected, axis=1),
        np.linalg.norm(residual, axis=1),
        _draws_out(T_base_tcp, wrench[0]),
        load.after,
        calibrated.covered_rows(q, *wrench),
    )


@dataclass(frozen=True, eq=False)
class _Load:
    calibrated: CalibratedModel
    force: FloatArray
    moment: FloatArray | None
    memory: FloatArray | None
    """Friction memory of the rows before the first."""
    unloaded: Unloaded | None = None
    """True tcp position without process force."""
    friction_torque: FloatArray | None = None
    """Torque of each friction element in each row, in N·m."""
    after: FloatArray = field(default_factory=lambda: np.zeros(0))
    """Friction memory after the last row."""

    @property
    def remembers(self) -> bool:
        return len(self.calibrated.model.friction) > 0

    def along(self, q: FloatArray) -> "_Load":
        """Return the load with what friction bears of it at the joints of all rows."""
        if not self.remembers:
            return self
        model = self.calibrated.model
        in_the_air = ~np.any(self.force, axis=1)
        if self.moment is not None:
            in_the_air &= ~np.any(self.moment, axis=1)
        memory = None if in_the_air[0] else self.memory
        # What overflows is refused by its size.
        with np.errstate(over="ignore", invalid="ignore"):
            load = model.load_torques(q, self.force, self.moment)
            visit = np.cumsum(in_the_air)
            friction_torque, after = model.friction.visits(
                model.weight_torques(q), load, visit, memory
            )
        return replace(self, friction_torque=friction_torque, after=after)

    def deflection(self, q: FloatArray, rows: IndexArray) -> FloatArray:
        model, c = self.calibrated.model, self.calibrated.compliance
        moment = None if self.moment is None else self.moment[rows]
        # What overflows is refused by its size.
        with np.errstate(over="ignore", invalid="ignore"):
            friction_torque = None if self.friction_torque is None else self.friction_torque[rows]
            return model.deflection(c, q, self.force[rows], moment, friction_torque)

    def misplaced(self, q: FloatArray, T_base_tcp: FloatArray) -> FloatArray:
        """Return the deviation of the unloaded tool from nominal at some joints, (row, 3)."""
        if self.unloaded is None:
            return np.zeros((len(q), 3))
        return np.asarray(self.unloaded(q) - T_base_tcp[:, :3, 3])


def _check_size(shift: FloatArray, deflection: FloatArray, largest: float, where: RowName) -> None:
    """Refuse deflections, and corrections of whatever they are made, that cannot be meant."""
    with np.errstate(over="ignore"):
        length, bend = np.linalg.norm(shift, axis=1), np.linalg.norm(deflection, axis=1)
    fits = (length <= largest) & (bend <= largest)
    if fits.all():
        return
    row = int(np.argmin(fits))
    if not bend[row] <= largest:
        raise PathError(
            f"{where(row)}: a deflection of {1e3 * bend[row]:.4g} mm is above the limit of"
            f" {1e3 * largest:.4g} mm: is the force in another unit or frame?"
        )
    raise PathError(
        f"{where(row)}: a correction of {1e3 * length[row]:.4g} mm is above the limit of"
        f" {1e3 * largest:.4g} mm; {1e3 * bend[row]:.4g} mm of it is deflection, the rest what the"
        " arm as built is off by: is its geometry of this arm?"
    )


def _draws_out(T_base_tcp: FloatArray, force: FloatArray) -> BoolArray:
    """Return where a force pulls the tool out, along +z of the tcp, shape (row,)."""
    along = np.einsum("ri,ri->r", T_base_tcp[:, :3, 2], force)
    return np.asarray(along > 0.5 * np.linalg.norm(force, axis=1))


def _error(T: FloatArray, off: FloatArray, T_wanted: FloatArray) -> FloatArray:
    loaded = T.copy()
    loaded[:, :3, 3] += off
    return pose_error(loaded, T_wanted)


def _small(error: FloatArray) -> BoolArray:
    position = np.linalg.norm(error[:, :3], axis=1)
    turn = np.linalg.norm(error[:, 3:], axis=1)
    return np.asarray((position <= _TOLERANCE) & (turn <= _TOLERANCE))


def _newton_step(robot: Robot, q: FloatArray, error: FloatArray) -> FloatArray:
    """Return a damped step of the arm's joints; external axes do not move."""
    jacobian = robot.jacobian(q)
    J = np.concatenate([jacobian.translation, jacobian.rotation], axis=-2)
    J = J[..., robot.external_axes :]
    Jt = np.swapaxes(J, -1, -2)
    weights = np.linalg.solve(J @ Jt + _DAMPING**2 * np.eye(6), error[..., None])
    step = np.zeros_like(q)
    step[:, robot.external_axes :] = np.clip((Jt @ weights)[..., 0], -_SMALL_TURN, _SMALL_TURN)
    return step


def _by_solver(
    solver: InverseKinematics,
    load: _Load,
    *,
    q_start: FloatArray,
    T: FloatArray,
    row: int,
    where: RowName,
) -> FloatArray:
    """Return one row by exact inverse kinematics, since Newton steps diverge near a singularity."""
    robot, q, wanted = solver.robot, q_start, T.copy()
    for _ in range(_STEPS):
        options = solver.solve(wanted, q_start[: robot.external_axes])
        if not len(options):
            break
        q = options[largest_move(robot, options - q).argmin()]
        off = load.deflection(q[None], np.array([row])) + load.misplaced(q[None], wanted[None])
        before, wanted = wanted, T.copy()
        wanted[:3, 3] -= off[0]
        if np.linalg.norm(wanted[:3, 3] - before[:3, 3]) <= _TOLERANCE:
            return np.asarray(q, dtype=float)
    x, y, z = 1e3 * wanted[:3, 3]
    raise PathError(
        f"{where(row)}: no posture reaches the corrected position ({x:.1f}, {y:.1f}, {z:.1f}) mm"
        " within the joint limits"
    )
