"""The cell at a posture: margins, sight, stiffness, and the deflection under each load case.

Every figure is what planning and prediction compute; here they are only asked, and put into words.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.errors import PlanningError, RobotError
from elastocal.planning import (
    BasePlacement,
    CollisionScene,
    PoolBuilder,
    Postures,
    cell_surface,
    collision_scene,
)
from elastocal.planning.checks import SightCheck, check_margins
from elastocal.planning.surface import Surface, sample_uniform
from elastocal.records import record
from elastocal.results import brief_repr
from elastocal.robot import xyzabc_from_T
from elastocal.studio.springs import CaseFigure, StiffnessFigure, StudioSprings
from elastocal.units import in_unit, quantity
from elastocal.viewer import Scene, cell_scene, packed_places
from elastocal.wording import in_words, millimetres, mm, readable

_PROBES = 32
"""Points by which positions of the rail are ranked, as planning does."""
_TOUCHES = 5e-5
"""Distance in m that counts as contact."""


@record()
class JointFigure:
    """One joint at a posture."""

    name: str
    value: float
    """In rad or m."""
    text: str
    """Value with its unit."""
    margin: str
    """Distance to the nearer limit."""
    passes: bool
    """Whether it keeps the margin that the cell asks for."""


@record()
class CheckFigure:
    """One check of planning at a posture."""

    name: str
    margin: str
    passes: bool
    advice: str


@record()
class SightFigure:
    """The view from one station to the marker."""

    station: str
    position: tuple[float, float, float]
    """Position of the station in base, in m."""
    text: str
    sees: bool


@brief_repr
@record()
class PostureFigures:
    """All that is shown of a posture."""

    q: tuple[float, ...]
    """In rad or m."""
    places: str
    """Places of the robot's parts, as the viewer takes them."""
    tcp: tuple[float, ...]
    """``T_base_tcp``: 16 numbers, row by row, in m."""
    position: str
    orientation: str
    """KUKA Z-Y'-X''."""
    joints: tuple[JointFigure, ...]
    checks: tuple[CheckFigure, ...]
    marker: tuple[float, float, float] | None
    sight: tuple[SightFigure, ...]
    surface: str
    """Distance of the tooling along the tool's axis."""
    stiffness: tuple[StiffnessFigure, ...]
    cases: tuple[CaseFigure, ...]
    refusal: str = ""
    """Why the posture is not the one that was asked for; empty where it is."""
    note: str = ""
    """What else was moved to get there; empty where nothing was."""


@dataclass(frozen=True, eq=False)
class CellView:
    """Cell as drawn."""

    cell: Cell
    surface: Surface
    springs: StudioSprings
    collisions: CollisionScene
    builder: PoolBuilder
    sight: SightCheck | None

    @staticmethod
    def of(cell: Cell, springs: StudioSprings) -> "CellView":
        """Return the view of a cell.

        Raises
        ------
        SurfaceError, FileAccessError
            If the surface cannot be read.
        """
        surface = cell_surface(cell)
        return CellView(
            cell,
            surface,
            springs,
            collision_scene(cell, surface),
            PoolBuilder.of(cell, surface),
            SightCheck.of(cell, surface),
        )

    @cached_property
    def scene(self) -> Scene:
        """Scene of the cell."""
        home = self.cell.home[None]
        return cell_scene(self.cell, self.surface, self.collisions, home, np.zeros((0, 3)))

    @cached_property
    def _placements(self) -> tuple[BasePlacement, ...]:
        """Positions of the external axes in order of preference, as in planning."""
        probes = sample_uniform(self.surface, _PROBES, np.random.default_rng(0))
        return self.builder.rank(probes)

    def at(self, q: ArrayLike, refusal: str = "", note: str = "") -> PostureFigures:
        """Return the figures of a posture; joints beyond their limits are set to them.

        Raises
        ------
        RobotError
            If there is not one finite number a joint.
        """
        robot = self.cell.robot
        inside = robot.check_positions(q)
        inside = np.clip(inside, robot.limits.lower, robot.limits.upper)
        T = robot.forward(inside)
        checks, reaches_off = self._checks(inside, T)
        marker = self._marker(T)
        x, y, z, a, b, c = xyzabc_from_T(T).tolist()
        return PostureFigures(
            q=tuple(inside.tolist()),
            places=packed_places(
                np.concatenate([body.T_frame_body for body in self.collisions.moving(inside[None])])
            ),
            tcp=tuple(T.ravel().tolist()),
            position=f"{millimetres((x, y, z))} mm",
            orientation=", ".join(quantity(angle, "°", ".1f") for angle in (a, b, c)),
            joints=self._joints(inside),
            checks=(*reaches_off, *checks),
            marker=marker,
            sight=self._sight(self._postures(inside, inside, T)),
            surface=self._distance(T),
            stiffness=self.springs.stiffness(inside, T),
            cases=self.springs.cases(inside, T, self.cell.file.load_cases.levels),
            refusal=refusal,
            note=note,
        )

    def towards(self, q: Sequence[float], T_base_tcp: FloatArray) -> PostureFigures:
        """Return the posture nearest to one that brings the tool to a place, if there is any.

        External axes stay where they are. Where the arm cannot get there the posture stays, and
        says so.
        """
        before = self.cell.robot.check_positions(q)
        found = self._nearest(before, T_base_tcp)
        if found is None:
            return self.at(before, "out of reach: no posture of the arm gets there")
        return self.at(found)

    def press(
        self, q: Sequence[float], origin: Sequence[float], direction: Sequence[float]
    ) -> PostureFigures:
        """Return the posture with which planning would press where a line meets the tooling.

        External axes stay where they are if a pose is had there; else the note says where they go.

        Parameters
        ----------
        q : sequence of float
            The posture until then, in rad or m.
        origin, direction : sequence of float
            Origin and direction of the line, in base, in m.

        Raises
        ------
        PlanningError
            If it does not meet the tooling.
        """
        hit = self._hit(np.asarray(origin, dtype=float), np.asarray(direction, dtype=float))
        if hit is None:
            raise PlanningError("the line does not meet the tooling")
        face, weights = hit
        point = self.surface.points(np.array([face]), weights[None])
        if not self.surface.in_region(point).all():
            return self.at(q, "outside the region")
        before = self.cell.robot.check_positions(q)[: self.cell.robot.external_axes]
        stays = BasePlacement(tuple(before.tolist()))
        for placements in ((stays,), self._placements):
            pool = self.builder.pool(placements, point)
            if len(pool.postures):
                found = pool.postures.q[0]
                return self.at(found, note=self._moved(before, found))
        return self.at(q, f"no pose here, refused by {in_words(pool.refusals[pool.refused_by[0]])}")

    def _moved(self, before: FloatArray, after: FloatArray) -> str:
        """Return which external axes were moved, in words; empty where none was."""
        robot = self.cell.robot
        axes = zip(robot.joint_names, robot.revolute, before.tolist(), after.tolist(), strict=False)
        moved = [
            f"{name} moved from {joint_text(old, turns)} to {joint_text(new, turns)}"
            for name, turns, old, new in axes
            if old != new
        ]
        return f"{', '.join(moved)}: from where it was, no pose is had here" if moved else ""

    def _nearest(self, q: FloatArray, T_base_tcp: FloatArray) -> FloatArray | None:
        robot = self.cell.robot
        external = np.clip(q, robot.limits.lower, robot.limits.upper)[: robot.external_axes]
        found = self.builder.solver.inverse.solve(T_base_tcp, external)
        if not len(found):
            return None
        nearest: FloatArray = found[np.abs(found - q).max(axis=1).argmin()]
        return nearest

    def _checks(
        self, q: FloatArray, T: FloatArray
    ) -> tuple[tuple[CheckFigure, ...], tuple[CheckFigure, ...]]:
        """Return the figures of all checks, and that of the approach pose where it fails."""
        off = T.copy()
        off[:3, 3] -= self.builder.solver.approach * T[:3, 2]
        away = self._nearest(q, off)
        margins = check_margins(
            self.builder.solver.checks.all, self._postures(q, q if away is None else away, T)
        )
        rows = zip(margins.names, margins.units, margins.advice, margins.margin[:, 0], strict=True)
        figures = tuple(
            CheckFigure(in_words(name), readable(float(margin), unit), bool(margin > 0.0), advice)
            for name, unit, advice, margin in rows
        )
        if away is not None:
            return figures, ()
        advice = "the arm cannot draw the tool back along its axis"
        return figures, (CheckFigure("approach", "none", False, advice),)

    def _postures(self, q: FloatArray, q_approach: FloatArray, T: FloatArray) -> Postures:
        point = np.zeros(1, dtype=np.intp)
        return Postures(T[None], -T[None, :3, 2], q[None], q_approach[None], point)

    def _joints(self, q: FloatArray) -> tuple[JointFigure, ...]:
        robot = self.cell.robot
        rows = zip(
            robot.joint_names,
            robot.revolute,
            q.tolist(),
            robot.limits.margin(q).tolist(),
            self.cell.joint_margin.tolist(),
            strict=True,
        )
        return tuple(
            JointFigure(
                name, value, joint_text(value, turns), joint_text(left, turns), left >= margin
            )
            for name, turns, value, left, margin in rows
        )

    def _marker(self, T: FloatArray) -> tuple[float, float, float] | None:
        marker = self.cell.file.marker
        if marker is None:
            return None
        x, y, z = (T[:3, :3] @ marker.position_tcp + T[:3, 3]).tolist()
        return x, y, z

    def _sight(self, postures: Postures) -> tuple[SightFigure, ...]:
        if self.sight is None:
            return ()
        margins = self.sight.margins(postures)[:, 0].tolist()
        return tuple(
            SightFigure(station.name, station.position, _sight_text(margin), margin > 0.0)
            for station, margin in zip(self.sight.stations, margins, strict=True)
        )

    def _hit(self, origin: FloatArray, direction: FloatArray) -> tuple[int, FloatArray] | None:
        """Return face and barycentric weights where a line first meets the tooling."""
        length = float(np.linalg.norm(direction))
        if not (np.isfinite(origin).all() and 0.0 < length < np.inf):
            raise RobotError("a line needs an origin and a direction, in numbers")
        rays = self.surface.rays.ray
        places, _, faces = rays.intersects_location(
            origin[None], direction[None] / length, multiple_hits=False
        )
        if not len(faces):
            return None
        a, b, c = self.surface.mesh.vertices[self.surface.mesh.faces[faces[0]]]
        u, v = np.linalg.lstsq(np.stack([b - a, c - a], axis=1), places[0] - a, rcond=None)[0]
        u, v = max(float(u), 0.0), max(float(v), 0.0)
        share = max(1.0, u + v)
        return int(faces[0]), np.array([1.0 - (u + v) / share, u / share, v / share])

    def _distance(self, T: FloatArray) -> str:
        """Return the distance of the tooling along the tool's axis, in words."""
        # From behind the tcp, so that a tool that has gone in is seen as well.
        start = self.builder.solver.approach
        hit = self._hit(T[:3, 3] - start * T[:3, 2], T[:3, 2])
        if hit is None:
            return "the tool does not point at the tooling"
        point = self.surface.points(np.array([hit[0]]), hit[1][None])
        gap = float((point.position[0] - T[:3, 3]) @ T[:3, 2])
        tilt = in_unit(float(np.arccos(np.clip(-point.normal[0] @ T[:3, 2], -1.0, 1.0))), "deg")
        where = f"{mm(abs(gap), 1)} {'off' if gap > 0.0 else 'in'} the tooling"
        where = "on the tooling" if abs(gap) < _TOUCHES else where
        return f"{where}, {tilt:.1f}° from its normal"


def joint_text(value: float, revolute: bool) -> str:
    """Return a joint position in words.

    >>> joint_text(0.5, True), joint_text(0.25, False)
    ('28.6°', '250.0 mm')
    """
    return quantity(value, "°", ".1f") if revolute else quantity(value, "mm", ".1f")


def _sight_text(margin: float) -> str:
    if margin > 0.0:
        return f"seen, {quantity(margin, '°', '.0f')} to spare"
    if margin <= -np.pi:
        return "hidden, or out of range"
    return f"turned away by {quantity(-margin, '°', '.0f')}"
