"""What every inverse kinematics solver offers, and what it returns."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elastocal.arrays import FloatArray
from elastocal.robot.robot import Robot


@dataclass(frozen=True, eq=False)
class InverseSolutions:
    """Configurations that reach each of many poses, one slot a branch."""

    q: FloatArray
    """Joint positions, shape (pose, branch, joint), in rad or m; NaN where there is none."""

    def __post_init__(self) -> None:
        q = np.array(self.q, dtype=float)
        q.setflags(write=False)
        object.__setattr__(self, "q", q)

    @property
    def exists(self) -> NDArray[np.bool_]:
        """Whether the slot holds a configuration, shape (pose, branch)."""
        return np.asarray(np.isfinite(self.q).all(axis=-1))

    @property
    def reachable(self) -> NDArray[np.bool_]:
        """Whether any configuration reaches the pose within the limits, shape (pose,)."""
        return np.asarray(self.exists.any(axis=-1))


class InverseKinematics(Protocol):
    """All joint configurations that reach a pose: `Robot.forward`, solved for ``q``.

    The arm is the last six joints; the positions of the external axes before it are given.
    A revolute joint counts modulo a turn: each branch is returned once, every joint at the
    equivalent position nearest to zero that its limits allow (plus rather than minus half a
    turn). `elastocal.robot.inverse.turns` lists the others.

    Every configuration returned is within the limits, has been put through `Robot.forward`,
    and reaches the pose to 1e-9 m and 1e-9 rad.
    """

    @property
    def robot(self) -> Robot:
        """The robot that is solved for."""

    @property
    def branches(self) -> int:
        """Number of slots a pose has in `solve_many`."""

    def solve(self, T_base_tcp: ArrayLike, external: ArrayLike = ()) -> FloatArray:
        """Return the distinct configurations that reach one pose.

        Parameters
        ----------
        T_base_tcp : array_like, shape (4, 4)
            Pose of the tool centre point in base, in m.
        external : array_like, shape (external axis,)
            Positions of the external axes, in rad or m.

        Returns
        -------
        ndarray, shape (solution, joint)
            External axes first, in rad or m; in the order of the branch slots, a configuration
            where two branches meet only once; shape (0, joint) when the pose is out of reach.

        Raises
        ------
        RobotError
            If the pose is no rigid transform, or an external position is missing or outside
            its limits.
        """

    def solve_many(self, T_base_tcp: ArrayLike, external: ArrayLike = ()) -> InverseSolutions:
        """Return the configurations that reach each of many poses, in branch slots.

        Parameters
        ----------
        T_base_tcp : array_like, shape (pose, 4, 4)
            Poses of the tool centre point in base, in m.
        external : array_like, shape (external axis,) or (pose, external axis)
            Positions of the external axes, in rad or m, for all poses or pose by pose.

        Raises
        ------
        RobotError
            As for `solve`; the message names the first bad pose.
        """
