"""Check ``sight``: some tracker station sees the marker (paper section 2.2).

A station sees the marker when the marker faces it within its acceptance angle, the distance is
within the tracker's range, and neither a mesh of the cell nor a link or the tool is between them.
`MovingSolids` describes why a tool does not hide the marker that it carries.

Postures are judged in contact. Unloaded readings are taken some 3 mm off the surface, which moves
beam and tool by less than the accuracy of the shapes of links and tool.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Self

import numpy as np
import trimesh

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.cell import Cell
from elastocal.errors import RobotError, of_kind
from elastocal.findings import Finding, Kind, as_count
from elastocal.planning.checks.check import PostureCheck
from elastocal.planning.postures import Postures
from elastocal.planning.scene import CollisionScene, fixture_bodies, tool_bodies
from elastocal.planning.surface import Surface
from elastocal.results import brief_repr
from elastocal.shapes import Beams, Body, Mesh, SightSolid
from elastocal.wording import phrase

MARKER_SEAT_LENGTH = 5e-3
"""Distance from the marker, in m, from which on arm and tool count: a marker sits on something."""
HOUSING_DEPTH = 1e-3
"""A tool shape is taken as the marker's housing if the marker lies deeper in it than this, in m. A
marker less deep, on a face that is drawn slightly too high, still sees through `MARKER_SEAT_LENGTH`
of it: everything within 78 deg (arc cosine of 1 mm over 5 mm) of the face's normal."""
REGISTRATION_POSES = 3
"""Poses that a station must measure to be registered: its rotation needs three points."""
_FEW = 8
"""Poses up to which a bumped station is hard to find."""
_OFF_THE_MARKER = 1e-3
"""Distance from the marker, in m, from which on meshes of the cell count."""


@dataclass(frozen=True)
class Station:
    """A laser tracker in its place."""

    name: str
    position: tuple[float, float, float]
    """In base, in m."""
    nearest: float
    """Shortest distance it measures, in m."""
    farthest: float
    """Longest distance it measures, in m."""


@brief_repr
@dataclass(frozen=True, eq=False)
class MovingSolids:
    """The collision shapes of links and tool, as solids that stop a beam.

    A shape stops a beam that is inside it anywhere from `MARKER_SEAT_LENGTH` off the marker to the
    station. One rule keeps a marker from being blinded by what holds it: a shape of the tool in
    which the marker lies deeper than `HOUSING_DEPTH` is drawn wider than the tool is, and stops
    only a beam that enters it again from outside. A convex shape is never entered again and so
    never stops any; a hollow mesh may. Links have no such exception.
    """

    scene: CollisionScene
    marker_tcp: FloatArray
    """Marker in the tcp frame, shape (3,), in m."""
    housings: tuple[str, ...] = field(init=False)
    """Names of the tool's shapes that hold the marker."""
    _solids: tuple[SightSolid, ...] = field(init=False, repr=False)
    _holds: tuple[bool, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        bodies = self.scene.moving(np.empty((0, len(self.scene.robot.joint_names))))
        solids = tuple(sight_solid(body) for body in bodies)
        tool = self.scene.tool
        links = len(bodies) - len(tool)
        holds = [
            solid.depth(_seen_from(body.T_frame_body, self.marker_tcp)) > HOUSING_DEPTH
            for body, solid in zip(tool, solids[links:], strict=True)
        ]
        names = tuple(body.name for body, held in zip(tool, holds, strict=True) if held)
        object.__setattr__(self, "housings", names)
        object.__setattr__(self, "_solids", solids)
        object.__setattr__(self, "_holds", (*[False] * links, *holds))

    def hide(self, q: FloatArray, beams: Beams) -> BoolArray:
        """Return whether links or tool block each beam.

        Parameters
        ----------
        q : ndarray, shape (pose, joint)
            Joint positions in rad or m.
        beams : Beams
            The beam from the marker at each posture, in base, shape (pose,).

        Returns
        -------
        ndarray of bool, shape (pose,)
        """
        hidden = np.zeros(len(beams), dtype=bool)
        bodies = self.scene.moving(q)
        for body, solid, holds in zip(bodies, self._solids, self._holds, strict=True):
            here = beams.seen_from(body.T_frame_body)
            if holds:
                hidden |= solid.crosses_again(here)
            else:
                hidden |= solid.crosses(here, MARKER_SEAT_LENGTH)
        return hidden


@brief_repr
@dataclass(frozen=True, eq=False)
class SightCheck(PostureCheck):
    """Acceptance angle of the marker, less the angle at which the best station is seen."""

    stations: tuple[Station, ...]
    marker_tcp: FloatArray
    """Marker in the tcp frame, shape (3,), in m."""
    axis_tcp: FloatArray
    """Direction that the marker faces, a unit vector in the tcp frame, shape (3,)."""
    acceptance_angle: float
    """Half angle of the cone within which the marker returns the beam, in rad."""
    obstacles: trimesh.Trimesh | None = None
    """Fixed solids that may block a beam, in base."""
    moving: MovingSolids | None = None
    """Links and tool, which may also block it."""
    name: str = "sight"
    unit: str = "rad"
    advice: str = phrase("move or add a tracker station, or turn the marker clear of arm and tool")
    order: ClassVar[int] = 80

    @classmethod
    def of(cls, cell: Cell, surface: Surface) -> Self | None:
        """Return the check that a station sees the marker; None without marker or stations."""
        marker, trackers = cell.file.marker, cell.file.trackers
        if marker is None or not trackers:
            return None
        stations = tuple(
            Station(tracker.name, tuple(tracker.position_base.tolist()), *map(float, tracker.range))
            for tracker in trackers
        )
        standing = [surface.rays, *(body.triangulated() for body in fixture_bodies(cell))]
        joined = trimesh.util.concatenate(standing)
        obstacles = of_kind(joined, trimesh.Trimesh, "what stands still")
        return cls(
            stations,
            marker.position_tcp,
            marker.axis_tcp,
            marker.acceptance,
            obstacles,
            MovingSolids(CollisionScene(cell.robot, tool_bodies(cell), ()), marker.position_tcp),
        )

    def margin(self, postures: Postures) -> FloatArray:
        """Return the margin of each posture, shape (pose,), in rad; -pi when no station sees."""
        return np.asarray(self.margins(postures).max(axis=0), dtype=float)

    def margins(self, postures: Postures) -> FloatArray:
        """Return the margin of each station, shape (station, pose), in rad; positive: it sees."""
        return np.array([self._of_station(station, postures) for station in self.stations])

    def seen_by(self, postures: Postures) -> list[str | None]:
        """Return the station that sees each posture's marker best, None where none does."""
        margins = self.margins(postures)
        best = margins.argmax(axis=0)
        return [
            self.stations[station].name if margins[station, pose] > 0.0 else None
            for pose, station in enumerate(best)
        ]

    def assigned(self, postures: Postures) -> list[str | None]:
        """Return the station that is to measure each posture, None where none sees it.

        The one that sees it best, but none that would measure fewer poses than its registration
        needs: see `assign_stations`.
        """
        chosen = assign_stations(self.margins(postures)).tolist()
        return [self.stations[station].name if station >= 0 else None for station in chosen]

    def _of_station(self, station: Station, postures: Postures) -> FloatArray:
        R, p = postures.T_base_tcp[:, :3, :3], postures.contact
        marker = p + R @ self.marker_tcp
        towards = np.asarray(station.position) - marker
        distance = np.linalg.norm(towards, axis=1)
        direction = towards / distance[:, None]
        cosine = np.clip(np.sum((R @ self.axis_tcp) * direction, axis=1), -1.0, 1.0)
        margin = self.acceptance_angle - np.arccos(cosine)
        possible = (station.nearest <= distance) & (distance <= station.farthest) & (margin > 0.0)
        beams = Beams(marker, direction, distance).take(possible)
        possible[possible] = self._clear(postures.q[possible], beams)
        unseen = np.where(margin > 0.0, -np.pi, margin)
        return np.asarray(np.where(possible, margin, unseen), dtype=float)

    def _clear(self, q: FloatArray, beams: Beams) -> BoolArray:
        """Return whether each posture's beam is free, shape (pose,)."""
        clear = np.ones(len(beams), dtype=bool)
        if self.obstacles is not None:
            clear = ~Mesh(self.obstacles).crosses(beams, _OFF_THE_MARKER)
        if self.moving is not None:
            clear[clear] = ~self.moving.hide(q[clear], beams.take(clear))
        return clear


def assign_stations(margins: FloatArray) -> IndexArray:
    """Return the station of each pose, so that each one used measures enough to be registered.

    Each pose goes to the station with the largest margin. A station that is left with fewer than
    `REGISTRATION_POSES` gives its poses to others that see them; where one of its poses is seen by
    no other, it is given poses that others can spare. Where neither helps, it keeps what it has.

    Parameters
    ----------
    margins : ndarray, shape (station, pose)
        Positive where a station sees a pose.

    Returns
    -------
    ndarray of int, shape (pose,)
        Number of the station, -1 where none sees the pose.
    """
    margins = np.where(margins > 0.0, margins, -np.inf)
    open_ = np.ones(len(margins), dtype=bool)
    for _ in range(len(margins)):
        chosen = _best(margins, open_)
        few = _too_few(chosen, len(margins))
        for station in few:
            others = open_ & (np.arange(len(margins)) != station)
            if (_best(margins, others)[chosen == station] >= 0).all():
                open_ = others
                break
        else:
            break
    for station in few:
        _give_spare_poses(chosen, station, margins)
    return chosen


def registration_shortages(seen_by: Sequence[str | None]) -> dict[str, tuple[int, ...]]:
    """Return the poses of each station that measures too few to be registered, by its name.

    Parameters
    ----------
    seen_by : sequence of str or None
        The station of each pose, in the order of their ids.
    """
    poses: dict[str, tuple[int, ...]] = {}
    for number, station in enumerate(seen_by):
        if station is not None:
            poses[station] = (*poses.get(station, ()), number)
    return {name: few for name, few in poses.items() if len(few) < REGISTRATION_POSES}


SHORTAGE = Kind(
    "plan.station-shortage",
    "station {station} sees {seen} of the {needed} poses that it needs to be"
    " registered: the readings at pose {poses} will be missing",
)
BUMPS_UNSEEN = Kind(
    "plan.bumps-unseen",
    "{poses} cannot show that a tracker station was bumped by less than about 2 mm (some"
    " thirty show 0.3 mm): see that nobody touches its stand",
    shown={"poses": as_count("pose")},
)


def station_shortage(station: str, poses: tuple[int, ...]) -> Finding:
    """Return the consequence for the poses of a station that cannot be registered."""
    return SHORTAGE(station=station, seen=len(poses), needed=REGISTRATION_POSES, poses=poses)


def unseen_bumps(seen_by: Sequence[str | None]) -> tuple[Finding, ...]:
    """Return a warning if there are too few poses to detect a moved station.

    The size of a detectable move midway, with 8 and with 30 poses, was measured on simulated cells:
    the page on registration has the table.

    Parameters
    ----------
    seen_by : sequence of str or None
        The station of each pose.
    """
    count = len(seen_by)
    return () if count > _FEW or not any(seen_by) else (BUMPS_UNSEEN(poses=count),)


def _best(margins: FloatArray, open_: BoolArray) -> IndexArray:
    """Return the open station that sees each pose best, -1 where none does."""
    seen = np.where(open_[:, None], margins, -np.inf)
    return np.where(np.isfinite(seen).any(axis=0), seen.argmax(axis=0), -1)


def _too_few(chosen: IndexArray, stations: int) -> list[int]:
    """Return the stations that cannot be registered, those with the fewest poses first."""
    count = np.bincount(chosen[chosen >= 0], minlength=stations)
    few = np.flatnonzero((count > 0) & (count < REGISTRATION_POSES))
    return sorted(map(int, few), key=lambda station: (count[station], station))


def _give_spare_poses(chosen: IndexArray, station: int, margins: FloatArray) -> None:
    """Fill a station up in place, with the poses that it sees with the least loss of margin."""
    sees = np.isfinite(margins[station]) & (chosen >= 0) & (chosen != station)
    candidates = np.flatnonzero(sees)
    loss = margins[chosen[candidates], candidates] - margins[station, candidates]
    wanted = REGISTRATION_POSES - np.count_nonzero(chosen == station)
    taken = chosen.copy()
    for pose in candidates[np.argsort(loss, kind="stable")].tolist():
        if wanted and np.count_nonzero(taken == taken[pose]) > REGISTRATION_POSES:
            taken[pose], wanted = station, wanted - 1
    if not wanted:
        chosen[:] = taken


def sight_solid(body: Body) -> SightSolid:
    """Return the solid of a link or a tool's part, of which it must be known what it hides.

    Raises
    ------
    RobotError
        If it is of another kind than box, capsule, cylinder, sphere or triangle mesh.
    """
    if isinstance(body.solid, SightSolid):
        return body.solid
    raise RobotError(
        f"collision shape {body.name!r} is a {type(body.solid.geometry).__name__}: the line of"
        " sight knows Box, Capsule, Cylinder, Sphere and triangle meshes"
    )


def _seen_from(T: FloatArray, point: FloatArray) -> FloatArray:
    return T[:3, :3].T @ (point - T[:3, 3])
