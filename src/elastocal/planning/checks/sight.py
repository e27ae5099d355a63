"""Check ``sight``: some tracker station sees the marker (spec section 2).

A station sees the marker when the marker faces it within its acceptance angle, the distance is
within the tracker's range, and no mesh of the cell stands between them. The arm itself is not
among those meshes.
"""

from dataclasses import dataclass

import numpy as np
import trimesh

from elastocal.arrays import BoolArray, FloatArray
from elastocal.planning.postures import Postures

_OFF_THE_MARKER = 1e-3
"""Distance from the marker at which a ray starts, in m, so that it does not hit its own seat."""


@dataclass(frozen=True)
class Station:
    """Where a laser tracker stands."""

    name: str
    position: tuple[float, float, float]
    """In base, in m."""
    nearest: float
    """Shortest distance it measures, in m."""
    farthest: float
    """Longest distance it measures, in m."""


@dataclass(frozen=True, eq=False)
class SightCheck:
    """Acceptance angle of the marker, less the angle at which the best station is seen."""

    stations: tuple[Station, ...]
    marker_tcp: FloatArray
    """Marker in the tcp frame, shape (3,), in m."""
    axis_tcp: FloatArray
    """Unit vector that the marker faces, in the tcp frame, shape (3,)."""
    acceptance: float
    """Half angle of the cone within which the marker returns the beam, in rad."""
    obstacles: trimesh.Trimesh | None = None
    """What may stand in the way, in base."""
    name: str = "sight"
    unit: str = "rad"
    advice: str = "move or add a tracker station, or turn the marker towards it"

    def margin(self, postures: Postures) -> FloatArray:
        """Return the margin of each posture, shape (pose,), in rad; -pi when no station sees."""
        margins = [self._of_station(station, postures) for station in self.stations]
        return np.asarray(np.max(margins, axis=0), dtype=float)

    def seen_by(self, postures: Postures) -> list[str | None]:
        """Return the station that sees each posture's marker best, None where none does."""
        margins = np.array([self._of_station(station, postures) for station in self.stations])
        best = margins.argmax(axis=0)
        return [
            self.stations[station].name if margins[station, pose] > 0.0 else None
            for pose, station in enumerate(best)
        ]

    def _of_station(self, station: Station, postures: Postures) -> FloatArray:
        R, p = postures.T_base_tcp[:, :3, :3], postures.contact
        marker = p + R @ self.marker_tcp
        towards = np.asarray(station.position) - marker
        distance = np.linalg.norm(towards, axis=1)
        direction = towards / distance[:, None]
        cosine = np.clip(np.sum((R @ self.axis_tcp) * direction, axis=1), -1.0, 1.0)
        margin = self.acceptance - np.arccos(cosine)
        possible = (station.nearest <= distance) & (distance <= station.farthest) & (margin > 0.0)
        possible[possible] = self._clear(marker[possible], direction[possible], distance[possible])
        unseen = np.where(margin > 0.0, -np.pi, margin)
        return np.asarray(np.where(possible, margin, unseen), dtype=float)

    def _clear(self, marker: FloatArray, direction: FloatArray, distance: FloatArray) -> BoolArray:
        """Return whether nothing stands between markers and a station, shape (ray,)."""
        if self.obstacles is None or not len(marker):
            return np.ones(len(marker), dtype=bool)
        start = marker + _OFF_THE_MARKER * direction
        where, ray, _ = self.obstacles.ray.intersects_location(start, direction, False)
        clear = np.ones(len(marker), dtype=bool)
        hit = np.linalg.norm(where - start[ray], axis=1) < distance[ray] - _OFF_THE_MARKER
        clear[ray[hit]] = False
        return clear
