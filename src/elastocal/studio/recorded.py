"""A run on disk as a page shows it: from the journal what happened, from the streams how.

A run that another process carries out is watched by its journal, which is on the disk before
anything moves on.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elastocal.arrays import BoolArray, FloatArray
from elastocal.errors import ElastocalError, ProcedureError
from elastocal.procedure import (
    JOURNAL,
    Entry,
    Event,
    PoseLog,
    RunFolder,
    commits,
    last_known,
    read_journal,
    read_streams,
)
from elastocal.procedure.record import Action
from elastocal.records import record
from elastocal.results import brief_repr

_SAMPLES, _FRAMES = 800, 160
"""Points of a curve, and postures of the arm, that a page gets of a pose."""
_AROUND = 0.1
"""Time before the first window of a pose and after the last that is shown, in s."""
_LISTED = 50
"""Runs that are looked for, at most."""


@record()
class RunEntry:
    """A run beside the cell file."""

    folder: str
    state: str
    """State in words."""
    live: bool
    """Whether its last session has not come to an end: it goes on, or its process has died."""


@brief_repr
@dataclass(frozen=True)
class RunView:
    """A run and its journal."""

    folder: RunFolder
    entries: tuple[Entry, ...]

    @staticmethod
    def read(path: Path) -> "RunView":
        """Return the run in a folder.

        Raises
        ------
        ProcedureError
            If there is none, or it has not been written yet.
        SchemaError, FileAccessError
            If its journal cannot be read.
        """
        folder = RunFolder(path)
        if not folder.journal.is_file():
            raise ProcedureError(f"{path} holds no run")
        entries = read_journal(folder.journal)
        if not entries:
            raise ProcedureError(f"{path}: nothing of the run has been written yet")
        return RunView(folder, entries)

    @property
    def live(self) -> bool:
        """Whether the last session has not written its last entry."""
        return self.entries[-1].event is not Event.FINISH

    @property
    def state(self) -> str:
        """Progress of the run, in words."""
        last = self.entries[-1]
        count = len(commits(self.entries))
        poses = f"{count} pose{'' if count == 1 else 's'} committed"
        return f"{poses}, goes on" if self.live else f"{poses}; {last.text}"

    def summary(self) -> dict[str, object]:
        """Return the recorded state, JSON-ready: poses, the last entries, the last target."""
        moves = [
            entry.target
            for entry in self.entries
            if entry.action is Action.MOVE and isinstance(entry.target, tuple)
        ]
        return {
            "folder": self.folder.path.name,
            "state": self.state,
            "live": self.live,
            "lines": list(last_known(self.entries).lines),
            "poses": [_committed(log) for log in commits(self.entries)],
            "last": [_said(entry) for entry in self.entries[-8:]],
            "q": list(moves[-1]) if moves else None,
        }

    def pose(self, pose: int) -> dict[str, object]:
        """Return the streams of a committed pose, thinned, JSON-ready.

        Forces are norms relative to the mean of the unloaded reference, which removes bias and tool
        weight; so are the positions of the marker.

        Raises
        ------
        ProcedureError
            If the pose is not committed.
        """
        log = next((each for each in commits(self.entries) if each.pose == pose), None)
        if log is None:
            raise ProcedureError(f"pose {pose} is not committed")
        # The path there and back would dominate the curve.
        start = min(each.start for each in log.windows) - _AROUND
        end = max(each.end for each in log.windows) + _AROUND
        streams = read_streams(self.folder.streams / log.streams, [(start, end)])
        reference = next(each for each in log.windows if each.load_case is None)
        span = (reference.start, reference.end)
        frames = _thinned(len(streams.arm.time), _FRAMES)
        return {
            "pose": pose,
            "start": start,
            "force": _curve(streams.wrench.time, streams.wrench.force, span, start),
            "marker": _curve(streams.points.time, streams.points.position, span, start),
            "windows": [
                {
                    "name": each.load_case or "unloaded",
                    "start": each.start - start,
                    "end": each.end - start,
                    "status": each.status.value,
                }
                for each in log.windows
            ],
            "marks": [{"time": each.time - start, "text": each.text} for each in streams.marks],
            "time": (streams.arm.time[frames] - start).tolist(),
            "q": streams.arm.q[frames].tolist(),
        }


def find_runs(beside: Path) -> tuple[RunEntry, ...]:
    """Return the runs in the folders of a folder, those that cannot be read with the reason."""
    found: list[RunEntry] = []
    for journal in sorted(beside.glob(f"*/{JOURNAL}"))[:_LISTED]:
        try:
            run = RunView.read(journal.parent)
        except ElastocalError as error:
            found.append(RunEntry(journal.parent.name, str(error), False))
        else:
            found.append(RunEntry(journal.parent.name, run.state, run.live))
    return tuple(found)


def _curve(
    time: FloatArray, vectors: FloatArray, span: tuple[float, float], start: float
) -> dict[str, list[float]]:
    """Return the distance of vectors from their mean within a span, over time."""
    inside: BoolArray = (time >= span[0]) & (time <= span[1])
    if not inside.any():
        return {"time": [], "value": []}
    size = np.linalg.norm(vectors - vectors[inside].mean(axis=0), axis=1)
    few = _thinned(len(time), _SAMPLES)
    return {"time": (time[few] - start).tolist(), "value": size[few].tolist()}


def _thinned(count: int, most: int) -> FloatArray:
    return np.unique(np.linspace(0, max(count - 1, 0), min(count, most)).astype(int))


def _committed(log: PoseLog) -> dict[str, object]:
    cases = [each for each in log.windows if each.load_case is not None]
    good = sum(each.status.value == "ok" for each in cases)
    return {"pose": log.pose, "attempt": log.attempt, "text": f"{good} of {len(cases)} cases ok"}


def _said(entry: Entry) -> str:
    where = "" if entry.pose is None else f"pose {entry.pose}, "
    parts = (
        entry.step or "",
        entry.event.value,
        entry.action.value if entry.action else "",
        entry.target if isinstance(entry.target, str) else "",
    )
    # A step that is called like its action or event is said once.
    what = " ".join(dict.fromkeys(part for part in parts if part))
    return f"{entry.time:.1f} s: {where}{what}{f' ({entry.text})' if entry.text else ''}"
