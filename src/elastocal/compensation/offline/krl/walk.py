"""The postures in which a program reaches its points, in the order of its text."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.offline import (
    PathError,
)
from elastocal.compensation.offline.krl.moves import Move
from elastocal.compensation.offline.krl.points import Point
from elastocal.compensation.offline.path_joints import RowName, check_limits, joints_along_path
from elastocal.robot import T_from_xyzabc, inverse_transform
from elastocal.robot.inverse import InverseKinematics

_FRAME = ("X", "Y", "Z", "A", "B", "C")
_ARM = tuple(f"A{number}" for number in range(1, 7))
_SAME = 1e-3
"""Postures nearer than this in every joint (rad or m) are one."""


@dataclass(frozen=True)
class Reached:
    """Postures at the targets of a program."""

    postures: dict[str, FloatArray]
    """Joints by the name of the target in capitals, each of shape (joint,), in rad or m."""
    assumed: tuple[str, ...]
    """Motions that come from a ``PTP`` which does not tell its posture."""


@dataclass(frozen=True, eq=False)
class Walk:
    """A robot that goes from point to point."""

    solver: InverseKinematics
    points: Mapping[str, Point]
    T_base_points: FloatArray
    """Frame of the program's points in the model's base, shape (4, 4), in m."""

    def postures(
        self, moves: tuple[Move, ...], targets: frozenset[str], start: FloatArray | None
    ) -> Reached:
        """Return the joints at each target, in the order in which they are first reached.

        Points that are no targets count for the posture from which the next is reached.

        Parameters
        ----------
        moves : tuple of Move
            Of the program.
        targets : frozenset of str
            Points that are corrected.
        start : ndarray, shape (joint,), or None
            Joints before the first move, in rad or m.

        Raises
        ------
        PathError
            If a target is out of reach, outside the limits, reached in two postures, or nothing
            says in which posture.
        """
        reached: dict[str, FloatArray] = {}
        assumed: list[str] = []
        previous, told = start, True
        for move in moves:
            point = move.axes or self.points.get(move.name or "")
            if point is None or not (move.name in targets or point.by_axes):
                # A PTP to a frame, or to a point declared elsewhere: S and T are not read.
                told = False
                continue
            here = self._reached(move, point, previous)
            if move.name in targets:
                check_limits(self.solver.robot, here[None], _naming(move), "is programmed")
                self._check_same(move, reached.setdefault(point.name.upper(), here), here)
                assumed += [] if told or point.by_axes else [_label(move)]
            previous, told = here, True
        return Reached(reached, tuple(assumed))

    def pose(self, point: Point, q: FloatArray) -> FloatArray:
        """Return T_base_tcp of a point that is reached with joints ``q``, shape (4, 4)."""
        if point.by_axes:
            return np.asarray(self.solver.robot.forward(q), dtype=float)
        x, y, z, a, b, c = point.values(_FRAME)
        T = T_from_xyzabc(1e-3 * x, 1e-3 * y, 1e-3 * z, *np.radians((a, b, c)))
        return np.asarray(self.T_base_points @ T, dtype=float)

    def numbers(self, point: Point, q: FloatArray, T_base_tcp: FloatArray) -> dict[str, float]:
        """Return the numbers of a corrected point by component, in mm or deg."""
        if point.by_axes:
            arm = np.degrees(q[self.solver.robot.external_axes :]).tolist()
            return dict(zip(_ARM, arm, strict=True))
        T = inverse_transform(self.T_base_points) @ T_base_tcp
        return dict(zip("XYZ", (1e3 * T[:3, 3]).tolist(), strict=True))

    def _reached(self, move: Move, point: Point, previous: FloatArray | None) -> FloatArray:
        external = self._external(move, point, previous)
        if point.by_axes:
            return np.concatenate([external, np.radians(point.values(_ARM))])
        if previous is None:
            raise PathError(
                f"{_label(move)}: nothing says in which posture: no motion to an E6AXIS of the .dat"
                " file comes before it, give --start"
            )
        T = self.pose(point, previous)
        q = joints_along_path(self.solver, T[None], external[None], previous, _naming(move))
        return np.asarray(q[0], dtype=float)

    def _external(self, move: Move, point: Point, previous: FloatArray | None) -> FloatArray:
        """Return the external axes: those of the point, else where they stood before."""
        robot = self.solver.robot
        names = [f"E{number}" for number in range(1, robot.external_axes + 1)]
        given = [name for name in names if name in point.components]
        if names and not given:
            if previous is None:
                raise PathError(f"{_label(move)} has no {names[0]}: give --start")
            return np.asarray(previous[: robot.external_axes], dtype=float)
        scale = [np.pi / 180.0 if robot.revolute[i] else 1e-3 for i in range(len(names))]
        external: FloatArray = np.array(point.values(names)) * np.array(scale)
        check_limits(robot, external[None], _naming(move), "is programmed")
        return external

    def _check_same(self, move: Move, before: FloatArray, here: FloatArray) -> None:
        gap = np.where(self.solver.robot.revolute, np.angle(np.exp(1j * (here - before))), 0.0)
        if not np.abs(gap).max() <= _SAME:
            raise PathError(
                f"{_label(move)}: is reached in another posture than before: it deflects otherwise"
                " there, make it two points"
            )


def _naming(move: Move) -> RowName:
    return lambda _: _label(move)


def _label(move: Move) -> str:
    return f"line {move.line}, {move.order} {move.name}"
