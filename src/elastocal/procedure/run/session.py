"""One session of a run: what it is to do, how far earlier sessions came, and how it ended.

A run takes one session when nothing goes wrong. After a fault, an interruption or a crash, another
one goes on from what the journal says.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum

from elastocal import __version__
from elastocal.cell import Cell, fingerprint
from elastocal.errors import ProcedureError
from elastocal.files import read_text, sha256
from elastocal.planning import PlanResult, PoseRecord
from elastocal.procedure.record import (
    Action,
    Entry,
    Event,
    PoseLog,
    RunFolder,
    RunRecord,
    StreamRecorder,
    commits,
)
from elastocal.procedure.run.routes import HomeRoute
from elastocal.procedure.run.settings import RunSettings
from elastocal.procedure.run.steps import ArmLocation, Progress
from elastocal.records import StrictModel
from elastocal.results import brief_repr
from elastocal.wording import spans

_SAME_SECTIONS = ("procedure", "devices", "simulation")
"""Sections of the cell file that must not change within a run: its readings would not belong
together. Those that the plan depends on are in the fingerprint."""

_TOUCHES = frozenset({Action.APPROACH, Action.HOLD, Action.RELEASE, Action.RETRACT})


@brief_repr
@dataclass(frozen=True, eq=False)
class Session:
    """A session that may begin."""

    plan: PlanResult
    settings: RunSettings
    folder: RunFolder
    committed: frozenset[int] = frozenset()
    """Poses that are finished already."""
    attempts: Mapping[int, int] = field(default_factory=dict)
    """Attempts that each pose has seen already."""
    home: HomeRoute = field(default_factory=lambda: HomeRoute(None, ()))
    """Path to HOME, which comes first."""
    resumes: bool = False
    """Whether it goes on with a run: a tool that an earlier session left pressing is freed."""
    order: tuple[int, ...] = ()
    """Ids of all poses in the order of their visits; empty: the plan's."""

    @property
    def visits(self) -> tuple[PoseRecord, ...]:
        """All poses of the plan, in the order of their visits."""
        return tuple(self.plan.poses[pose] for pose in self.order) or self.plan.poses


@dataclass(frozen=True)
class SessionHooks:
    """Recorder, listener and interruption of a session."""

    recorder: Callable[[], StreamRecorder]
    """Makes the recorder of one attempt."""
    report: Callable[[Progress], None] = lambda _: None
    """Called several times a second."""
    interrupted: Callable[[], bool] = lambda: False
    """Whether the run was asked to stop."""
    fault: Callable[[str], None] = lambda _: None
    """Called at once when a fault is seen; what follows may take long. It must not wait."""
    enough: Callable[[PoseLog], str] = lambda _: ""
    """Called after each pose is committed, while the arm stands still off the surface; returns why
    the run has enough poses, or nothing."""
    stack: Callable[[int], Callable[[], bool]] = lambda _: lambda: True
    """Asks a person to stack so many disks between tool and tooling, the arm at HOME and disarmed;
    returns at once a function that says whether it is done."""


class RunEnd(Enum):
    """Reason for the end of a session."""

    DONE = "done"
    """Every pose was tried, or enough of them; the arm is at HOME."""
    STOPPED = "stopped"
    """A fault."""
    INTERRUPTED = "interrupted"
    """A person."""


@brief_repr
@dataclass(frozen=True)
class SessionResult:
    """Result of a session, and the position of the arm at its end."""

    end: RunEnd
    location: ArmLocation
    message: str
    """Why; empty when all went well."""
    given_up: tuple[int, ...]
    """Poses of this session that failed."""
    failed_attempts: int
    """Attempts of this session that failed."""
    enough: bool = False
    """Whether it ended because there were enough poses."""


@brief_repr
@dataclass(frozen=True)
class LastKnown:
    """Progress of a run."""

    entry: Entry
    """The last one."""
    committed: tuple[int, ...]
    """Poses that are finished, in the order in which they were."""
    given_up: tuple[int, ...]
    """Poses that failed."""
    attempts: Mapping[int, int]
    """Attempts that each pose has seen."""
    may_touch: bool
    """Whether the tool may have been at the surface when the journal ends."""
    uncommitted: int | None = None
    """The pose that was worked on last, if it was not finished."""

    @property
    def finished(self) -> bool:
        """Whether a session has come to its end, with the arm at HOME."""
        text = self.entry.text
        return self.entry.event is Event.FINISH and text.startswith(RunEnd.DONE.value)

    def left_to_do(self, poses: int) -> str:
        """Return the work left for `--resume` in a plan of so many poses; empty: none."""
        left = sorted(set(range(poses)) - set(self.committed))
        if left:
            return f"measures pose {spans(left)}"
        return "" if self.finished else "only brings the arm to HOME, every pose is committed"

    @property
    def lines(self) -> tuple[str, ...]:
        """Lines that a person should read before the run continues."""
        entry = self.entry
        done = ", ".join(map(str, self.committed)) or "none"
        where = "between poses" if entry.pose is None else f"pose {entry.pose}"
        what = entry.action.value if entry.action else entry.event.value
        attempt = "" if entry.attempt is None else f", attempt {entry.attempt}"
        step = f", {entry.step}" if entry.step else ""
        text = f" ({entry.text})" if entry.text else ""
        return (
            f"last entry: {where}{attempt}{step}: {entry.event.value} {what}{text}"
            if entry.action
            else f"last entry: {where}{attempt}{step}: {what}{text}",
            f"at {entry.time:.1f} s of the run's clock",
            f"poses committed: {done}",
            *((f"poses given up: {', '.join(map(str, self.given_up))}",) if self.given_up else ()),
            *(("the tool may have been at the surface",) if self.may_touch else ()),
        )


def last_known(entries: tuple[Entry, ...]) -> LastKnown:
    """Return the progress of a run.

    Parameters
    ----------
    entries : tuple of Entry
        All of its journal; at least the first.
    """
    committed = tuple(log.pose for log in commits(entries))
    attempts: Counter[int] = Counter()
    for entry in entries:
        if entry.pose is not None and entry.attempt is not None:
            attempts[entry.pose] = max(attempts[entry.pose], entry.attempt)
    worked_on = next((e.pose for e in reversed(entries) if e.pose is not None), None)
    lost = {e.pose for e in entries if e.event is Event.GIVEN_UP and e.pose is not None}
    return LastKnown(
        entry=entries[-1],
        committed=committed,
        given_up=tuple(sorted(lost - set(committed))),
        attempts=attempts,
        may_touch=_may_touch(entries),
        uncommitted=None if worked_on in committed else worked_on,
    )


def run_record(
    cell: Cell,
    plan: PlanResult,
    *,
    plan_text: str,
    cell_file: str,
    seed: int,
    started: str,
    signer: str | None = None,
    stated: Mapping[str, str] | None = None,
) -> RunRecord:
    """Return the record by which a run is known again.

    Raises
    ------
    ProcedureError
        If the plan was made for another cell.
    """
    found = fingerprint(cell)
    if plan.cell.fingerprint != found:
        raise ProcedureError(
            f"the plan belongs to another cell: it was made for {plan.cell.name!r} with"
            f" fingerprint {plan.cell.fingerprint[:12]}, {cell.path} has {found[:12]};"
            " plan again, or run the cell that it was made for"
        )
    return RunRecord(
        elastocal=__version__,
        plan=sha256(plan_text),
        cell=found,
        cell_file=cell_file,
        seed=seed,
        started=started,
        cell_sha256=sha256(read_text(cell.path)),
        signer=signer,
        stated=dict(stated or {}),
    )


def check_same_run(record: RunRecord, wanted: RunRecord, where: str) -> None:
    """Refuse to go on with another run than the one that is in a folder.

    Raises
    ------
    ProcedureError
        With what differs.
    """
    remedies = {
        "plan": "give the plan that it was begun with",
        "cell": "set the cell file back, which is in its folder cell",
        "seed": f"give --seed {record.seed}",
        "signer": "give --sign with its key" if record.signer else "leave --sign out",
        "touch": f"give --touch {record.touch}" if record.touch else "leave --touch out",
    }
    for key, remedy in remedies.items():
        found, asked = getattr(record, key), getattr(wanted, key)
        if found != asked:
            raise ProcedureError(
                f"{where} holds another run: its {key} is {_short(found)}, not {_short(asked)};"
                f" to go on with it {remedy}, for a new run name another folder"
            )


def check_same_settings(used: Cell, wanted: Cell) -> None:
    """Refuse to go on with other settings than a run was started with.

    Parameters
    ----------
    used, wanted : Cell
        Cell in the run's folder, and the present one.

    Raises
    ------
    ProcedureError
        With the first key that differs.
    """
    for section in _SAME_SECTIONS:
        old, new = (_dump(getattr(cell.file, section, None)) for cell in (used, wanted))
        for key in {**old, **new}:
            if old.get(key) != new.get(key):
                raise ProcedureError(
                    f"{wanted.path}: {section}.{key} is {new.get(key)!r}, the run was started"
                    f" with {old.get(key)!r}: set it back, or start another run"
                )


def _may_touch(entries: tuple[Entry, ...]) -> bool:
    for entry in reversed(entries):
        if entry.action is Action.RETRACT and entry.event is Event.END:
            return False
        if entry.event is Event.COMMIT or entry.action is Action.MOVE:
            return False
        if entry.action in _TOUCHES:
            return True
    return False


def _dump(section: object) -> dict[str, object]:
    if isinstance(section, StrictModel):
        return section.model_dump(mode="json")
    return {} if section is None else {"": section}


def _short(value: object) -> str:
    return value[:12] if isinstance(value, str) else str(value)
