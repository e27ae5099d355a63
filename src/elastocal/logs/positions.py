"""From logs of arm and tracker to positions of the unloaded arm, a table for `geometry`.

No force is needed. Where the logs hold one, only plateaus count at which nothing presses.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elastocal.arrays import FloatArray, IndexArray
from elastocal.errors import LogError
from elastocal.logs.clocks import ClockFit
from elastocal.logs.doubts import marker_contradictions, still_columns, stream_doubts
from elastocal.logs.map import LogMap, Site
from elastocal.logs.merge import aligned, merged, standing
from elastocal.logs.plateaus import Plateau, name_loads
from elastocal.logs.streams import LogStreams, read_streams_of
from elastocal.procedure.record import SAME_TIME, Streams
from elastocal.progress import Progress
from elastocal.results import brief_repr
from elastocal.robot import Robot
from elastocal.tables import write_table
from elastocal.wording import counted

_LEAST = 5
"""Fewest positions of a table that `geometry` can leave some of out."""


@brief_repr
@dataclass(frozen=True, eq=False)
class ImportedPositions:
    """Positions of markers on the unloaded arm, a row for each station that saw it at rest."""

    robot: Robot
    q: FloatArray
    """Joints, shape (row, joint), in rad or m."""
    markers: FloatArray
    """In the frame of the row's station, shape (row, marker, 3), in m; NaN where hidden."""
    station: NDArray[np.str_]
    """Shape (row,)."""
    pose: IndexArray
    """Number of the pose, shape (row,)."""
    clocks: tuple[ClockFit, ...]
    plateaus: int
    """All that were found, loaded ones included."""
    warnings: tuple[str, ...]

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.q)

    def write(self, path: Path) -> None:
        """Write the table that `geometry` reads: degrees and millimetres.

        Raises
        ------
        FileAccessError
            If it cannot be written.
        """
        turns = np.array(self.robot.revolute)
        heads = [
            f"{name}[{'deg' if turned else 'mm'}]"
            for name, turned in zip(self.robot.joint_names, turns.tolist(), strict=True)
        ]
        heads += ["station", "pose"]
        heads += [f"marker{m}_{a}[mm]" for m in range(1, self.markers.shape[1] + 1) for a in "xyz"]
        write_table(path, heads, self._cells(np.where(turns, 180.0 / np.pi, 1e3)))

    def _cells(self, scale: FloatArray) -> Iterator[list[object]]:
        points = np.round(1e3 * self.markers.reshape(len(self), -1), 6)
        rows = zip(scale * self.q, self.station, self.pose, points, strict=True)
        for q, station, pose, seen in rows:
            there = ["" if np.isnan(value) else value for value in seen.tolist()]
            yield [*np.round(q, 7).tolist(), str(station), int(pose), *there]


def import_positions(
    log_map: LogMap, site: Site, files: Sequence[Path], progress: Progress
) -> ImportedPositions:
    """Return the positions of markers at the plateaus of logs.

    Parameters
    ----------
    log_map : LogMap
        What their columns are.
    site : Site
        What they were taken from.
    files : sequence of Path
        The logs.
    progress : Progress
        Called with stage, done and total.

    Raises
    ------
    LogError
        If a log cannot be read as the map says, none holds markers, the clocks cannot be
        determined, or there are too few plateaus.
    FileAccessError
        If a file cannot be read.
    """
    progress("logs", 0, 3)
    logs = read_streams_of(log_map, files, site.robot)
    count = {each.markers.shape[1] for each in logs if each.markers is not None}
    if len(count) != 1:
        how = " and ".join(map(str, sorted(count)))
        raise LogError(
            f"logs hold {how} markers: a table of positions has as many in each row"
            if count
            else "no log holds markers: positions are those of a tracker"
        )
    progress("clocks", 1, 3)
    still = tuple(still_columns(logs, site.robot))
    logs, clocks = aligned(logs, log_map, site, still)
    progress("plateaus", 2, 3)
    streams = merged(logs, site)
    by_word = next((log for log in logs if log.arm is not None and log.handshake), None)
    at_rest = standing(streams, site, by_word)
    named = at_rest.bare
    if len(streams.wrench.time):
        states = [each.tool for each in at_rest.readings]
        named = name_loads(named, states, site.sensor, log_map.load_cases)
    free = [each for each in named if each.pose >= 0 and each.load is None]
    spans = [(each.start, each.end) for each in free]
    astray = () if still else tuple(marker_contradictions(streams, spans, log_map, site))
    seen = [each for plateau in free for each in _rows(plateau, streams, logs, at_rest.least)]
    if len({pose for *_, pose in seen}) < _LEAST:
        poses = counted(len({pose for *_, pose in seen}), "pose")
        raise LogError(
            f"markers were seen at {poses} at rest and unloaded, of {len(at_rest.bare)} plateaus:"
            f" at least {_LEAST} are needed"
        )
    q, markers, station, pose = zip(*seen, strict=True)
    progress("plateaus", 3, 3)
    return ImportedPositions(
        robot=site.robot,
        q=np.stack(q),
        markers=np.stack(markers),
        station=np.array(station),
        pose=np.array(pose),
        clocks=clocks,
        plateaus=len(at_rest.bare),
        warnings=(*still, *astray, *stream_doubts(logs, clocks, site), *_left_out(log_map)),
    )


def _left_out(log_map: LogMap) -> Iterator[str]:
    """Yield what the map says and the table does not: a tool that the URDF may lack."""
    mass = 0.0 if log_map.tool is None else log_map.tool.mass
    if mass > 0.0:
        yield (
            f"the table does not hold the tool of the map ({mass:.4g} kg): if the URDF for"
            " `geometry` lacks it, add payload[kg], payload_x[mm], payload_y[mm] and payload_z[mm]"
            " (its centre in the tcp), or compliances come out too large"
        )


def _rows(
    plateau: Plateau, streams: Streams, logs: Sequence[LogStreams], least: int
) -> Iterator[tuple[FloatArray, FloatArray, str, int]]:
    """Yield mean joints and markers of each station that saw a plateau, with its pose."""
    near = plateau.start - SAME_TIME, plateau.end + SAME_TIME
    q = streams.arm.q[slice(*np.searchsorted(streams.arm.time, near))]
    for log in logs:
        if log.markers is None or not len(q):
            continue
        own = log.markers[slice(*np.searchsorted(log.time, near))]
        seen = np.asarray(np.isfinite(own).all(axis=2))
        enough = np.asarray(seen.sum(axis=0) >= least)
        if enough.any():
            total = np.where(seen[:, :, None], own, 0.0).sum(axis=0)
            mean = total / np.maximum(seen.sum(axis=0), 1)[:, None]
            places = np.where(enough[:, None], mean, np.nan)
            yield q.mean(axis=0), places, log.entry.station, plateau.pose
