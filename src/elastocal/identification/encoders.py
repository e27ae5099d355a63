"""Secondary encoders: what they see of the joints, as further rows of the observation system.

An encoder behind a gear sees how far the link is from where the motor has it. Since the reference
that is, for a joint whose own springs have the rows ``A(q, f)`` (`ElasticModel.joint_blocks`),

    delta = link - motor - (link - motor)_0 = (A(q, f) + S_A(q) - S_A(q_0) - A(q_0, f_0)) c,

with all that friction and temperature do to the gear. The tool moves by ``J_a delta`` then, which
is taken off the deflection: the tracker's rows are left with the springs that no encoder sees,

    d - J_a delta = O_rest c_rest.

So the two do not share an error of the gears. Where no link was read at the reference, the zero of
each pose is unknown: the mean of its readings is taken off the encoders' rows, and the tracker's
stay as they are.

What an encoder sees counts as much as what it moves the tool by: rows are in m.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray, IndexArray
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.errors import present
from elastocal.identification.displacement import Between
from elastocal.records import record
from elastocal.results import brief_repr
from elastocal.robot import Robot

_SCATTER = 3e-5
"""Friction that a free move leaves in a gear, in rad: what the zeros of encoders scatter by."""
_WAVE = 3e-4
"""Size of an error once a turn, and of a balancer's effect on its gear, in rad."""
_STIFF = 1e-9
"""Smallest softness of a gear that its sag is expected by, in rad/(N·m) or m/N."""
_SILENT = 1e-7
"""What an encoder sees at least of a gear under load, in rad or m."""
_STRANGE = 0.9
"""Share of what an encoder sees from which on loads do not explain it: gears of the simulated cells
leave up to 0.4, one with the wrong sign or of another joint all."""
_FRICTION = 6e-5
"""What friction alone may show at a joint that is hardly loaded, in rad or m."""
_LEAST_LEVER = 0.1
"""Lever of a joint whose axis passes through the tool, in m: its encoder sees it all the same."""


@brief_repr
@dataclass(frozen=True, eq=False)
class EncoderRows:
    """Rows of secondary encoders, beside those of the tracker."""

    joints: tuple[str, ...]
    """Joints with an encoder."""
    rows: FloatArray
    """``lever [A delta]``, shape (reading, encoder, parameter + 1), in m per unit and m."""
    seen: FloatArray
    """``[O d]`` of what the encoders see of the tracker's rows, shape (reading, 3, parameter + 1);
    zero where the links were not read at the reference."""
    lever: FloatArray
    """Lever of each joint, shape (encoder,), in m, or 1 of a prismatic one."""
    units: tuple[str, ...]
    """``rad`` or ``m``, of each joint."""
    weight: FloatArray
    """Weight of the rows of each reading, shape (reading,)."""

    def weighted(self) -> FloatArray:
        """Return the weighted rows."""
        return np.asarray(self.rows * self.weight[:, None, None])

    def take(self, readings: ArrayLike) -> "EncoderRows":
        """Return the rows of some of the readings."""
        index = np.asarray(readings)
        return replace(
            self, rows=self.rows[index], seen=self.seen[index], weight=self.weight[index]
        )

    def with_columns(self, columns: IndexArray) -> "EncoderRows":
        """Return the rows of some of the parameters."""
        kept = [*columns, -1]
        return replace(self, rows=self.rows[..., kept], seen=self.seen[..., kept])

    def widened(self, columns: int) -> "EncoderRows":
        """Return the rows with further columns behind those of the springs, which they do not see.

        Parameters
        ----------
        columns : int
            How many.
        """

        def wider(rows: FloatArray) -> FloatArray:
            zeros = np.zeros((*rows.shape[:2], columns))
            return np.concatenate([rows[..., :-1], zeros, rows[..., -1:]], axis=2)

        return replace(self, rows=wider(self.rows), seen=wider(self.seen))

    def alone(self, rows: FloatArray) -> "EncoderRows":
        """Return weighted rows in place of these, beside rows of a tracker that lack them."""
        seen = np.zeros((len(rows), 3, rows.shape[2]))
        return replace(self, rows=rows, seen=seen, weight=np.ones(len(rows)))

    def reweighted(self, factor: FloatArray) -> "EncoderRows":
        """Return the rows with each reading's squared residual multiplied by a factor."""
        return replace(self, weight=self.weight * np.sqrt(factor))

    def residuals(self, compliance: FloatArray) -> FloatArray:
        """Return what the model predicts less what the encoders see, (reading, encoder), in rad."""
        return np.asarray((self.rows[..., :-1] @ compliance - self.rows[..., -1]) / self.lever)

    def summary(
        self,
        O: FloatArray,  # noqa: E741 - paper
        d: FloatArray,
        compliance: FloatArray,
        folds: FloatArray,
    ) -> "EncoderSummary":
        """Return what encoders brought to a fit.

        Parameters
        ----------
        O, d : ndarray, shape (reading, 3, parameter) and (reading, 3)
            The tracker's rows.
        compliance : ndarray, shape (parameter,)
            The solution.
        folds : ndarray, shape (reading, parameter)
            Compliances of the fit without each reading's pose.
        """
        left = np.sqrt(np.mean(np.square(self.residuals(compliance)), axis=0))
        held_out = None
        if np.any(self.seen):
            predicted = np.einsum("rin,rn->ri", O - self.seen[..., :-1], folds)
            error = predicted - (d - self.seen[..., -1])
            held_out = float(np.linalg.norm(error, axis=1).mean())
        seen = np.sqrt(np.mean(np.square(self.rows[..., -1] / self.lever), axis=0))
        figures = tuple(seen.tolist()), tuple(left.tolist())
        return EncoderSummary(self.joints, self.units, *figures, (), held_out)


@record()
class EncoderZero:
    """What an encoder reads of a joint in the air: mounting, sag of the arm, an error once a turn.

    ``link - motor = offset + weight tau_w + sine sin q + cosine cos q``, with the torque ``tau_w``
    of the arm's own weight about the joint. A balancer, which no mass of the URDF describes, is a
    sine of its joint as well.
    """

    joint: str
    offset: float
    """In rad or m."""
    weight: float
    """In rad/(N·m) or m/N."""
    sine: float
    """In rad; 0 of a prismatic joint."""
    cosine: float
    left: float
    """Root mean square of what it leaves at the poses that it is from, in rad or m: friction."""


@brief_repr
@record()
class EncoderSummary:
    """What secondary encoders brought to a fit."""

    joints: tuple[str, ...]
    """Joints with an encoder."""
    units: tuple[str, ...]
    """``rad`` or ``m``, of each."""
    seen: tuple[float, ...]
    """Root mean square of what each sees of its joint, in rad or m."""
    unexplained: tuple[float, ...]
    """The same of what the model leaves of it."""
    zeros: tuple[EncoderZero, ...]
    """What each reads in the air; empty: the links were not read at the reference."""
    held_out: float | None
    """Mean error at left-out poses where the encoders are read in production, too, in m; None:
    the links were not read at the reference."""


def silent_encoders(found: EncoderSummary) -> tuple[str, ...]:
    """Return the joints whose encoders see nothing: they follow their motors."""
    pairs = zip(found.joints, found.seen, strict=True)
    return tuple(joint for joint, seen in pairs if seen < _SILENT)


def strange_encoders(found: EncoderSummary) -> tuple[str, ...]:
    """Return the joints whose encoders see what no load on their gears makes."""
    each = zip(found.joints, found.seen, found.unexplained, strict=True)
    return tuple(joint for joint, seen, left in each if left > max(_STRANGE * seen, _FRICTION))


def encoder_rows(
    model: ElasticModel, readings: Readings, marker_offset: ArrayLike | None = None
) -> EncoderRows | None:
    """Return the rows of the secondary encoders in readings; None: there are none.

    Parameters
    ----------
    model : ElasticModel
        Robot and springs.
    readings : Readings
        With joints in the robot's order.
    marker_offset : array_like, shape (3,), optional
        Marker in the tcp frame, in m.
    """
    own = list(readings.encoders)
    if not own:
        return None
    between = Between.of(model, readings)
    link = present(readings.link_joint_position, "link_joint_position")[:, own]
    apart = link - readings.joint_position[:, own]
    A = between.of_joints()[:, own]
    zeroed = readings.reference_link_joint_position
    if zeroed is not None:
        q_0 = np.broadcast_to(between.reference.q, readings.joint_position.shape)
        apart = apart - (zeroed[:, own] - q_0[:, own])
    rows = np.concatenate([A, apart[..., None]], axis=2)
    J = marker_jacobian(model, readings, marker_offset)[:, :, own]
    seen = np.einsum("rie,ren->rin", J, rows)
    if zeroed is None:
        rows, seen = rows - _pose_means(rows, readings.pose), np.zeros_like(seen)
    revolute = np.array(model.robot.revolute)[own]
    lever = np.sqrt(np.mean(np.square(J).sum(axis=1), axis=0))
    lever = np.where(revolute, np.maximum(lever, _LEAST_LEVER), 1.0)
    joints = tuple(model.robot.joint_names[joint] for joint in own)
    units = tuple("rad" if turns else "m" for turns in revolute)
    return EncoderRows(joints, rows * lever[:, None], seen, lever, units, np.ones(len(readings)))


def encoder_zeros(
    model: ElasticModel, readings: Readings, compliance: FloatArray
) -> tuple[EncoderZero, ...]:
    """Return what the encoders read in the air, from the references of the poses.

    Regularised, since few poses do not tell the four numbers of a joint apart.

    Parameters
    ----------
    model, readings
        As for `encoder_rows`.
    compliance : ndarray, shape (parameter,)
        Of the springs.
    """
    own, zeroed = list(readings.encoders), readings.reference_link_joint_position
    if not own or zeroed is None:
        return ()
    between = Between.of(model, readings)
    _, first = np.unique(readings.pose, return_index=True)
    q = np.broadcast_to(between.reference.q, zeroed.shape)[first]
    air = zeroed[first] - q - (between.of_joints_at_reference() @ compliance)[first]
    weight = between.reference.joint_weight[first]
    sag = (model.joint_sag_blocks(between.reference) @ compliance)[first]
    squares = np.maximum(np.square(weight).sum(axis=0), np.finfo(float).tiny)
    softness = (sag * weight).sum(axis=0) / squares
    return tuple(
        _zero_of(model.robot, j, air[:, j], q[:, j], weight[:, j], softness[j]) for j in own
    )


def _zero_of(
    robot: Robot, joint: int, air: FloatArray, q: FloatArray, weight: FloatArray, softness: float
) -> EncoderZero:
    """Return the numbers of a joint, near what its gear alone would do."""
    turns = robot.revolute[joint]
    columns = [np.ones_like(q), weight, *((np.sin(q), np.cos(q)) if turns else ())]
    rows = np.stack(columns, axis=1)
    expected = np.array([0.0, softness, 0.0, 0.0][: len(columns)])
    prior = np.array([0.0, _SCATTER / max(softness, _STIFF), *[_SCATTER / _WAVE] * 2])
    prior = np.diag(prior[: len(columns)])
    system = np.vstack([rows, prior])
    right = np.concatenate([air, prior @ expected])
    found = np.linalg.lstsq(system, right, rcond=None)[0]
    left = float(np.sqrt(np.mean(np.square(rows @ found - air))))
    offset, slope, *waves = found.tolist()
    sine, cosine = waves or (0.0, 0.0)
    return EncoderZero(robot.joint_names[joint], offset, slope, sine, cosine, left)


def marker_jacobian(
    model: ElasticModel, readings: Readings, marker_offset: ArrayLike | None = None
) -> FloatArray:
    """Return the Jacobian of the marker for the joints, shape (reading, 3, joint)."""
    q, robot = readings.joint_position, model.robot
    J = robot.jacobian(q)
    if marker_offset is None or not np.any(marker_offset):
        return J.translation
    lever = robot.forward(q)[:, :3, :3] @ np.asarray(marker_offset, dtype=float)
    return np.asarray(J.translation + np.cross(J.rotation, lever[..., None], axis=1))


def _pose_means(rows: FloatArray, pose: IndexArray) -> FloatArray:
    """Return the mean of the rows at each reading's pose, of the same shape."""
    _, index, counts = np.unique(pose, return_inverse=True, return_counts=True)
    sums = np.zeros((len(counts), *rows.shape[1:]))
    np.add.at(sums, index, rows)
    return np.asarray((sums / counts[:, None, None])[index])
