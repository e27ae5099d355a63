"""The elastic model of a robot (paper section 2.3, Eq. 1-14).

With the spring Jacobian ``J`` (translation) and ``W`` (rotation) at the tool centre point, a
force ``f`` and a moment ``m`` on the robot make the spring torques

    tau = J^T f + W^T m,                                   (Eq. 9)

and, with compliances ``c``, the deflection

    deflection = J diag(c) tau = O c,    O = J diag(tau).  (Eq. 10, 11, 14)
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray, IndexArray
from elastocal.elastic.springs import Spring, check_springs, is_axial
from elastocal.errors import SpringError
from elastocal.robot import (
    ChainModel,
    InsertedJoint,
    Jacobian,
    Robot,
    build_model,
    evaluate_jacobian,
)


@dataclass(frozen=True)
class CartesianCompliance:
    """How a pose yields to a wrench at the tool centre point, in base axes."""

    translation: FloatArray
    """Displacement per force, shape (..., 3, 3), in m/N; symmetric."""
    rotation: FloatArray
    """Rotation per moment, shape (..., 3, 3), in rad/(N·m); symmetric."""
    coupling: FloatArray
    """Displacement per moment, shape (..., 3, 3), in m/(N·m); its transpose is rotation per
    force."""

    def translational_stiffness(self) -> FloatArray:
        """Return the force per displacement when the tool may turn, shape (..., 3, 3), in N/m.

        Raises
        ------
        SpringError
            If a direction has no compliance at all.
        """
        if not np.all(np.linalg.cond(self.translation) < 1.0 / np.finfo(float).eps):
            raise SpringError("Cartesian compliance is singular: some direction does not yield")
        return np.asarray(np.linalg.inv(self.translation), dtype=float)


@dataclass(frozen=True, eq=False)
class ElasticModel:
    """A robot with springs; compliances are arguments, so that one model serves many fits."""

    robot: Robot
    springs: tuple[Spring, ...]
    _chain: ChainModel = field(init=False, repr=False)
    _columns: IndexArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "springs", tuple(self.springs))
        check_springs(self.springs, self.robot.joint_names)
        chain, columns = _insert_springs(self.robot, self.springs)
        object.__setattr__(self, "_chain", chain)
        object.__setattr__(self, "_columns", columns)

    @property
    def spring_names(self) -> tuple[str, ...]:
        """Names of the springs, in the order of every compliance vector."""
        return tuple(spring.name for spring in self.springs)

    def spring_jacobian(self, q: ArrayLike) -> Jacobian:
        """Return the Jacobian of the tool centre point for the springs (paper Eq. 1-3).

        Parameters
        ----------
        q : array_like, shape (..., joint)
            Joint positions in rad or m.

        Returns
        -------
        Jacobian
            Columns are the springs, shape (..., 3, spring).
        """
        return evaluate_jacobian(self._chain, self.robot.check_positions(q), self._columns)

    def observation_blocks(
        self,
        q: ArrayLike,
        force: ArrayLike,
        moment: ArrayLike | None = None,
        marker_offset: ArrayLike | None = None,
    ) -> FloatArray:
        """Return the rows of the observation matrix (paper Eq. 11, 14): ``O c = deflection``.

        ``q`` and ``force`` are broadcast over their leading axes, so that many load cases at
        one pose cost one Jacobian.

        Parameters
        ----------
        q : array_like, shape (..., joint)
            Joint positions after the load case has settled, in rad or m.
        force : array_like, shape (..., 3)
            Force on the robot at the tool centre point, in base, in N.
        moment : array_like, shape (..., 3), optional
            Moment on the robot about the tool centre point, in base, in N·m.
        marker_offset : array_like, shape (3,), optional
            Point whose displacement is observed, in the tcp frame, in m: a metrology marker
            that is not at the tool centre point has its own Jacobian. Default: the tcp.

        Returns
        -------
        ndarray, shape (..., 3, spring)
            In m per unit of compliance.

        Raises
        ------
        RobotError, SpringError
            If an argument has another shape or is not finite.
        """
        force = check_vectors("force", force)
        moment = None if moment is None else check_vectors("moment", moment)
        jacobian = self.spring_jacobian(q)
        torques = spring_torques(jacobian, force, moment)
        observed = jacobian.translation
        if marker_offset is not None and np.any(marker_offset):
            rotation = self.robot.forward(q)[..., :3, :3]
            lever = rotation @ check_vectors("marker_offset", marker_offset)
            observed = observed + np.cross(jacobian.rotation, lever[..., None], axis=-2)
        blocks: FloatArray = observed * torques[..., None, :]
        return blocks

    def deflection(
        self,
        compliance: ArrayLike,
        q: ArrayLike,
        force: ArrayLike,
        moment: ArrayLike | None = None,
    ) -> FloatArray:
        """Return the deflection ``O c``: real minus commanded position of the tcp.

        Parameters
        ----------
        compliance : array_like, shape (spring,)
            In rad/(N·m) or m/N.
        q, force, moment : array_like
            As for `observation_blocks`.

        Returns
        -------
        ndarray, shape (..., 3)
            In base, in m.
        """
        c = self.check_compliance(compliance)
        return self.observation_blocks(q, force, moment) @ c

    def cartesian_compliance(self, compliance: ArrayLike, q: ArrayLike) -> CartesianCompliance:
        """Return the Cartesian compliance ``J diag(c) J^T`` at a pose (paper Eq. 10).

        Parameters
        ----------
        compliance : array_like, shape (spring,)
            In rad/(N·m) or m/N.
        q : array_like, shape (..., joint)
            Joint positions in rad or m.
        """
        c = self.check_compliance(compliance)
        jacobian = self.spring_jacobian(q)
        J, W = jacobian.translation, jacobian.rotation
        return CartesianCompliance(
            (J * c) @ np.swapaxes(J, -1, -2),
            (W * c) @ np.swapaxes(W, -1, -2),
            (J * c) @ np.swapaxes(W, -1, -2),
        )

    def check_compliance(self, compliance: ArrayLike) -> FloatArray:
        """Return compliances as a float array, or refuse them by shape or value.

        Raises
        ------
        SpringError
            If there is not one finite number a spring.
        """
        c = np.asarray(compliance, dtype=float)
        if c.shape != (len(self.springs),) or not np.all(np.isfinite(c)):
            raise SpringError(
                f"compliances must be {len(self.springs)} finite numbers, one a spring,"
                f" got shape {c.shape}"
            )
        return c


def check_vectors(name: str, vectors: ArrayLike) -> FloatArray:
    """Return vectors as a float array, or refuse them by name.

    Raises
    ------
    SpringError
        If the last axis is not x, y, z or a value is not finite.
    """
    array = np.asarray(vectors, dtype=float)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise SpringError(f"{name} has shape {array.shape}: the last axis must be x, y, z")
    if not np.all(np.isfinite(array)):
        raise SpringError(f"{name} holds a value that is not finite")
    return array


def spring_torques(
    jacobian: Jacobian, force: ArrayLike, moment: ArrayLike | None = None
) -> FloatArray:
    """Return the torque about each spring, ``J^T f + W^T m`` (paper Eq. 9).

    Returns
    -------
    ndarray, shape (..., spring)
        In N·m, or N for prismatic springs.
    """
    f = np.asarray(force, dtype=float)
    torques: FloatArray = (f[..., None, :] @ jacobian.translation)[..., 0, :]
    if moment is not None:
        m = np.asarray(moment, dtype=float)
        torques = torques + (m[..., None, :] @ jacobian.rotation)[..., 0, :]
    return torques


def _insert_springs(robot: Robot, springs: Sequence[Spring]) -> tuple[ChainModel, IndexArray]:
    """Build the chain; axial springs share the column of the joint itself."""
    joints = {joint.name: index for index, joint in enumerate(robot.chain.joints)}
    own = [is_axial(spring, robot.chain.joints[joints[spring.joint]]) for spring in springs]
    inserted = [
        InsertedJoint(
            spring.name,
            joints[spring.joint],
            np.array(spring.axis),
            spring.revolute,
            spring.distal,
            np.array(spring.offset),
        )
        for spring, shares in zip(springs, own, strict=True)
        if not shares
    ]
    chain = build_model(robot.chain, inserted)
    virtual = iter(chain.inserted_columns)
    columns = [
        chain.joint_columns[joints[spring.joint]] if shares else next(virtual)
        for spring, shares in zip(springs, own, strict=True)
    ]
    return chain, np.array(columns, dtype=np.intp)
