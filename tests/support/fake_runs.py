"""Runs of Procedure 1 on the fake cell: a plan, settings, a recorder, and the runner on top."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from elastocal.cell import ProcedureSettings
from elastocal.planning import PlanResult, PoseRecord, SpreadRecord
from elastocal.planning.motion import AxisMotion
from elastocal.planning.plan_result import (
    CellRecord,
    ContactRecord,
    MoveRecord,
    PoolRecord,
    RobotRecord,
    SearchRecord,
)
from elastocal.procedure import (
    Event,
    Journal,
    RunFolder,
    Runner,
    RunRecord,
    RunSettings,
    Session,
    SessionHooks,
    SessionResult,
    home_route,
    last_known,
    read_journal,
)
from support.fake_devices import DOWN, FakeCell, fake_cell

HOME = (0.0, 0.0, 0.5)
APPROACH, NEAR = 0.05, 0.003
LOADS = {
    "normal": (0.0, 0.0, -300.0),
    "north": (80.0, 0.0, -300.0),
    "south": (-80.0, 0.0, -300.0),
}
QUICK = ProcedureSettings(
    cycle="40 ms",
    approach_speed="250 mm/s",
    contact_speed="20 mm/s",
    contact_force="20 N",
    ramp="1600 N/s",
    dwell="0.2 s",
    average="0.2 s",
    unloaded_average="0.2 s",
    timeout="4 s",
    beam_timeout="2 s",
)
RECORD = RunRecord(
    elastocal="0", plan="p", cell="c", cell_file="cell.yaml", seed=0, started="2026-01-01T00:00:00Z"
)


def plan(poses: int = 2, loads: int = 2) -> PlanResult:
    """Return poses in a row on a flat floor; every other move has a via pose."""
    records = tuple(_pose(number) for number in range(poses))
    stops = [None, *range(poses), None]
    spread = SpreadRecord(covering_radius=0.1, boundary_distance=None, nearest_neighbour=None, o1=1)
    return PlanResult(
        elastocal="0",
        cell=CellRecord(name="fake", file="cell.yaml", fingerprint="0" * 64),
        robot=RobotRecord(
            name="fake", urdf="<robot/>", base="b", tcp="t", joints=("x", "y", "z"), home=HOME
        ),
        contact=ContactRecord(
            approach_distance=APPROACH,
            near_contact=NEAR,
            axis_override=0.2,
            contact_speed=0.02,
            load_cases=dict(list(LOADS.items())[:loads]),
        ),
        poses=records,
        moves=tuple(
            MoveRecord(
                start=stops[i],
                end=stops[i + 1],
                via=((0.1 * i, 0.1, 0.3),) if i % 2 else (),
                duration=1.0,
            )
            for i in range(poses + 1)
        ),
        search=SearchRecord(
            name="cover",
            metric="euclidean",
            seed=0,
            wanted=poses,
            d_max=None,
            covering_radius=0.1,
            lower_bound=None,
            covered=None,
            order=tuple(range(poses)),
            spread=spread,
        ),
        comparison=None,
        pool=PoolRecord(file="pool.nc", sampled=poses, valid=poses, checks=(), bottleneck=None),
        findings=(),
    )


def _pose(number: int) -> PoseRecord:
    x = 0.1 + 0.1 * (number % 50)
    return PoseRecord(
        id=number,
        candidate=number,
        joints=(x, 0.0, 0.0),
        approach_joints=(x, 0.0, APPROACH),
        tcp_position=(x, 0.0, 0.0),
        tcp_quaternion=(1.0, 0.0, 0.0, 0.0),
        normal=(0.0, 0.0, 1.0),
        seen_by="station_1",
        contact_time=10.0,
        margins={},
    )


def settings(of: PlanResult, **changes: Any) -> RunSettings:
    """Return quick settings; changes are keys of the section ``procedure``."""
    loads = tuple((name, np.array(force)) for name, force in of.contact.load_cases.items())
    return RunSettings(
        procedure=QUICK.model_copy(update=changes),
        override=1.0,
        axes=AxisMotion(np.ones(3), 0.1),
        R_tcp_sensor=np.eye(3),
        force_limit=450.0,
        force_tolerance=5.0,
        weight_base=np.array([0.0, 0.0, -600.0]),
        near_contact=NEAR,
        approach_distance=APPROACH,
        loads=loads,
    )


@dataclass
class MemoryRecorder:
    """Keeps streams in a dictionary in place of files."""

    kept: dict[str, dict[str, np.ndarray]]
    blocks: dict[str, list[np.ndarray]] = field(
        default_factory=lambda: {"q": [], "time": [], "force": [], "points": [], "point_time": []}
    )
    marks: list[str] = field(default_factory=list)

    def arm(self, state: Any) -> None:
        self.blocks["q"].append(state.q)

    def wrenches(self, block: Any) -> None:
        self.blocks["time"].append(block.time)
        self.blocks["force"].append(block.force)

    def points(self, block: Any) -> None:
        self.blocks["point_time"].append(block.time)
        self.blocks["points"].append(block.position)

    def mark(self, time: float, text: str) -> None:
        self.marks.append(f"{time:.2f} {text}")

    def save(self, path: Path) -> None:
        parts = {name: np.concatenate(blocks) for name, blocks in self.blocks.items() if blocks}
        self.kept[path.name] = parts


@dataclass
class FakeRun:
    """A run folder with what is needed to start, kill and resume it."""

    path: Path
    plan: PlanResult = field(default_factory=plan)
    changes: dict[str, Any] = field(default_factory=dict)
    kept: dict[str, dict[str, np.ndarray]] = field(default_factory=dict)
    cell: FakeCell | None = None
    tell: Callable[[Any], None] = lambda _: None
    interrupted: Callable[[], bool] = lambda: False
    recorder: Callable[[], Any] | None = None
    faults: list[str] = field(default_factory=list)
    """What was told at once."""
    enough: Callable[[Any], str] = lambda _: ""
    order: tuple[int, ...] = ()
    stack: Callable[[int], str] = lambda _: ""

    @property
    def settings(self) -> RunSettings:
        return settings(self.plan, **self.changes)

    @property
    def journal(self) -> Path:
        return RunFolder(self.path).journal

    def start(
        self, prepare: Callable[[FakeCell], None] = lambda _: None, **journal: Any
    ) -> SessionResult:
        """Run from the beginning; ``prepare`` scripts the faults."""
        self.path.mkdir(exist_ok=True)
        with Journal(self.journal, **journal) as log:
            log.write(0.0, Event.START, run=RECORD)
            return self._go(log, 0.0, prepare)

    def resume(
        self,
        prepare: Callable[[FakeCell], None] = lambda _: None,
        cell: FakeCell | None = None,
        **journal: Any,
    ) -> SessionResult:
        """Go on, with fresh devices at HOME unless others are given."""
        with Journal(self.journal, **journal) as log:
            known = last_known(read_journal(self.journal))
            start = known.entry.time
            log.write(start, Event.RESUME)
            return self._go(log, start, prepare, cell, resumes=True)

    def _go(
        self,
        log: Journal,
        start: float,
        prepare: Callable[[FakeCell], None],
        cell: FakeCell | None = None,
        *,
        resumes: bool = False,
    ) -> SessionResult:
        self.cell = cell or fake_cell(HOME, start)
        prepare(self.cell)
        known = last_known(read_journal(self.journal))
        state = self.cell.arm.state()
        job = Session(
            self.plan,
            self.settings,
            RunFolder(self.path),
            committed=frozenset(known.committed),
            attempts=known.attempts,
            home=home_route(
                self.plan,
                state.q,
                state.T_base_tcp,
                self.settings.procedure.travel_limit,
                known.uncommitted,
            ),
            resumes=resumes,
            order=self.order,
        )
        recorder = self.recorder or (lambda: MemoryRecorder(self.kept))
        told = self.tell, self.interrupted, self.faults.append, self.enough, self.stack
        hooks = SessionHooks(recorder, *told)
        return Runner(job, self.cell.devices, log, hooks).run()

    def readings(self) -> dict[tuple[int, str | None], np.ndarray]:
        """Return mean force and marker of each committed window."""
        found = {}
        for entry in read_journal(self.journal):
            for window in entry.log.windows if entry.log else ():
                kept = self.kept[entry.log.streams]
                at = (kept["time"] > window.start) & (kept["time"] <= window.end)
                seen = (kept["point_time"] > window.start) & (kept["point_time"] <= window.end)
                found[entry.log.pose, window.load_case] = np.concatenate(
                    [kept["force"][at].mean(axis=0), kept["points"][seen].mean(axis=0)]
                )
        return found


__all__ = ["DOWN", "HOME", "FakeRun", "MemoryRecorder", "plan", "replace", "settings"]
