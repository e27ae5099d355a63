"""State and actions of the studio: one cell, its view, one work at a time.

`Session.actions` are the requests of a page, by name. Each takes a message, refuses an invalid one,
and returns JSON-ready data; pages in several windows show the same cell.
"""

import re
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from elastocal.cell import Arming, Cell, load_cell
from elastocal.errors import ElastocalError, ProcedureError, SchemaError
from elastocal.planning import PLAN, read_plan
from elastocal.records import from_data, record, to_data
from elastocal.results import brief_repr
from elastocal.robot import T_from_xyzabc
from elastocal.studio.cell_edit import CellEdit, CellText, form_of, region_around
from elastocal.studio.posture import CellView
from elastocal.studio.recorded import RunView, find_runs
from elastocal.studio.springs import StudioSprings
from elastocal.studio.trials import compare_techniques, survey_reach
from elastocal.studio.worker import Data, Outbox, Worker, WorkState
from elastocal.units import with_fixed_units
from elastocal.viewer import scene_data
from elastocal.wording import duration, readable

_FOLDER = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")
"""Names of folders that a page may have made beside the cell file."""
Posture = tuple[float, ...]


@brief_repr
@record()
class PostureMessage:
    """Joint positions."""

    q: Posture


@brief_repr
@record()
class PlaceMessage:
    """Requested position of the tool, from a posture."""

    q: Posture
    position: tuple[float, float, float]
    """In base, in m."""
    orientation: tuple[float, float, float] | None = None
    """a, b, c in rad (Z-Y'-X''); None: as it is."""


@brief_repr
@record()
class LineMessage:
    """Line of sight of the viewer, from a posture."""

    q: Posture
    origin: tuple[float, float, float]
    direction: tuple[float, float, float]


@record()
class PlanMessage:
    """Options of a plan."""

    folder: str
    replace: bool = False
    """Replace the plan that is in the folder."""


@record()
class RunMessage:
    """Plan to carry out, and folder of the record."""

    plan: str
    folder: str
    resume: bool = False
    confirmed: bool = False
    """A person has looked at the cell."""
    cell: str = ""
    """SHA-256 of the cell file that the page shows; needed where real devices move."""
    rate: float = 0.0
    """Seconds of a simulated cell a second of the wall, at most; 0: as fast as it goes."""


@record()
class AnswerMessage:
    """Answer to a question of a run: what it asked for has been done."""

    question: int
    """Its number."""


@record()
class FolderMessage:
    """A folder beside the cell file."""

    folder: str
    pose: int | None = None


@record()
class Nothing:
    """No message."""


class StudioWork(Protocol):
    """Works of commands that the studio starts, each in a process of its own."""

    def check(self, cell: Path) -> object:
        """Refuse a file that is no cell."""

    def springs(self, cell: Cell) -> StudioSprings:
        """Return the springs to predict with."""

    def plan(self, cell: Path, message: PlanMessage) -> Callable[[Outbox], Data]:
        """Return the work of planning; it can be pickled."""

    def run(self, cell: Path, message: RunMessage, arming: Arming) -> Callable[[Outbox], Data]:
        """Return the work of a run; it can be pickled."""

    def watch(self, cell: Path) -> Callable[[Outbox], Data]:
        """Return the work of watching the devices, which moves nothing; it can be pickled."""

    def is_real(self, cell: Cell) -> bool:
        """Return whether something moves that can hurt."""


@dataclass(frozen=True)
class _Opened:
    """A cell file with what was made of it."""

    text: CellText
    view: CellView
    number: int
    """Grows with each time that it is read."""


class Session:
    """A cell in the studio.

    Parameters
    ----------
    path : Path
        Cell file.
    work : StudioWork
        Who does the work of commands.
    armed : bool
        Whether a run may move devices that are not simulated.

    Raises
    ------
    ElastocalError
        If the cell cannot be used.
    """

    def __init__(self, path: Path, work: StudioWork, armed: bool = False) -> None:
        self._path, self._work, self._armed = path, work, armed
        self._changed = threading.Condition()
        self._number = 0
        # Kinematics share buffers: one page at a time computes.
        self._computing = threading.RLock()
        self._opened = self._open(0)
        self.worker = Worker(self._tell)
        makers: tuple[tuple[type[Any], Callable[[Any], Mapping[str, object]]], ...] = (
            (Nothing, self._scene),
            (PostureMessage, self._posture),
            (PlaceMessage, self._place),
            (LineMessage, self._press),
            (CellEdit, self._edit),
            (Nothing, self._reload),
            (PlanMessage, self._plan),
            (FolderMessage, self._poses),
            (Nothing, self._compare),
            (Nothing, self._survey),
            (RunMessage, self._run),
            (Nothing, self._watch),
            (Nothing, self._stop),
            (AnswerMessage, self._answer),
            (Nothing, self._folders),
            (FolderMessage, self._record),
        )
        self.actions: Mapping[str, Callable[[Any], Mapping[str, object]]] = {
            work.__name__.removeprefix("_"): partial(_asked, kind, work) for kind, work in makers
        }
        """Requests of a page, by name."""

    @property
    def name(self) -> str:
        """Name of the cell."""
        return self._opened.view.cell.name

    @property
    def is_running(self) -> bool:
        """Whether a run is going on."""
        news = self.worker.news
        return news.kind == "run" and news.state is WorkState.BUSY

    def news(self, number: int, patience: float) -> tuple[int, Mapping[str, object]]:
        """Return the newest news and its number, as soon as it is another than ``number``.

        Parameters
        ----------
        number : int
            Number of the news that is known; -1: none.
        patience : float
            How long to wait for another, in s.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._number != number, patience)
            news = self.worker.news
            return self._number, {"work": to_data(news), "cell": self._opened.number}

    def close(self) -> None:
        """Stop what is going on; a run brings its arm to safety first."""
        self.worker.close()

    def _tell(self) -> None:
        with self._changed:
            self._number += 1
            self._changed.notify_all()

    def _open(self, number: int) -> _Opened:
        text = CellText.read(self._path)
        cell = load_cell(self._path)
        return _Opened(text, CellView.of(cell, self._work.springs(cell)), number)

    def _scene(self, _: Nothing) -> Mapping[str, object]:
        with self._computing:
            opened = self._opened
            view, cell = opened.view, opened.view.cell
            limits, robot = cell.robot.limits, cell.robot
            return {
                "number": opened.number,
                "name": cell.name,
                "file": str(self._path),
                "robot": robot.name,
                "text": opened.text.text,
                "form": to_data(form_of(cell)),
                "bounds": to_data(region_around(cell, view.surface.mesh.vertices)),
                "scene": scene_data(view.scene),
                "springs": view.springs.source,
                "joints": [
                    {"name": name, "turns": turns, "low": low, "high": high}
                    for name, turns, low, high in zip(
                        robot.joint_names,
                        robot.revolute,
                        _bounded(limits.lower, robot.revolute, -1.0),
                        _bounded(limits.upper, robot.revolute, 1.0),
                        strict=True,
                    )
                ],
                "home": cell.home.tolist(),
                "posture": to_data(view.at(cell.home.tolist())),
                "sha256": cell.sha256,
                "real": self._work.is_real(cell),
                "armed": self._armed,
            }

    def _posture(self, message: PostureMessage) -> Mapping[str, object]:
        with self._computing:
            return _shown(self._opened.view.at(message.q))

    def _place(self, message: PlaceMessage) -> Mapping[str, object]:
        with self._computing:
            view = self._opened.view
            T = np.array(view.cell.robot.forward(message.q))
            if message.orientation is not None:
                T = np.array(T_from_xyzabc(*message.position, *message.orientation))
            T[:3, 3] = message.position
            return _shown(view.towards(message.q, T))

    def _press(self, message: LineMessage) -> Mapping[str, object]:
        with self._computing:
            view = self._opened.view
            return _shown(view.press(message.q, message.origin, message.direction))

    def _edit(self, edit: CellEdit) -> Mapping[str, object]:
        with self._computing:
            opened = self._opened
            text = opened.text.edited(edit, opened.view.cell)
            if text != opened.text.text:
                opened.text.save(text, self._work.check)
                self._opened = self._open(opened.number + 1)
                self._tell()
            return {"changed": text != opened.text.text}

    def _reload(self, _: Nothing) -> Mapping[str, object]:
        with self._computing:
            self._opened = self._open(self._opened.number + 1)
            self._tell()
            return {"changed": True}

    def _plan(self, message: PlanMessage) -> Mapping[str, object]:
        self._require_folder(message.folder)
        self.worker.begin("plan", self._work.plan(self._path, message))
        return {}

    def _compare(self, _: Nothing) -> Mapping[str, object]:
        self.worker.begin("compare", partial(compare_techniques, self._path))
        return {}

    def _survey(self, _: Nothing) -> Mapping[str, object]:
        self.worker.begin("survey", partial(survey_reach, self._path))
        return {}

    def _run(self, message: RunMessage) -> Mapping[str, object]:
        self._require_folder(message.folder)
        self._require_folder(message.plan)
        cell = self._opened.view.cell
        real = self._work.is_real(cell)
        if real:
            if not self._armed:
                raise ProcedureError(
                    "the cell names devices that are not simulated: nothing moves unless the studio"
                    " was started with --arm"
                )
            if not message.confirmed:
                raise ProcedureError("not confirmed: nothing was moved")
            if message.cell != cell.sha256:
                raise ProcedureError(
                    "the page shows another state of the cell file: look at the new one first"
                )
            message = replace(message, rate=0.0)
        else:
            # Nothing can be hurt, so nobody has to look before a run is continued.
            message = replace(message, confirmed=True)
        # The worker reads the file again: it must be this one.
        arming = Arming(cell.sha256, real)
        self.worker.begin("run", self._work.run(self._path, message, arming))
        return {}

    def _watch(self, _: Nothing) -> Mapping[str, object]:
        self.worker.begin("watch", self._work.watch(self._path))
        return {}

    def _stop(self, _: Nothing) -> Mapping[str, object]:
        self.worker.stop()
        return {}

    def _answer(self, message: AnswerMessage) -> Mapping[str, object]:
        self.worker.answer(message.question)
        return {}

    def _folders(self, _: Nothing) -> Mapping[str, object]:
        beside = self._path.resolve().parent
        plans = sorted(each.parent.name for each in beside.glob(f"*/{PLAN}"))
        return {"plans": plans, "runs": to_data(find_runs(beside))}

    def _poses(self, message: FolderMessage) -> Mapping[str, object]:
        plan = read_plan(self._require_folder(message.folder))
        search = plan.search
        return {
            "folder": message.folder,
            "summary": with_fixed_units(
                f"{len(plan.poses)} poses by {search.name}, covering radius"
                f" {readable(search.covering_radius, 'm')}, {duration(plan.total_time)}"
            ),
            "findings": [with_fixed_units(each) for each in plan.findings],
            "poses": [
                {
                    "id": pose.id,
                    "q": list(pose.joints),
                    "position": list(pose.tcp_position),
                    "station": pose.seen_by or "no station",
                }
                for pose in plan.poses
            ],
        }

    def _record(self, message: FolderMessage) -> Mapping[str, object]:
        run = RunView.read(self._require_folder(message.folder))
        return run.summary() if message.pose is None else run.pose(message.pose)

    def _require_folder(self, name: str) -> Path:
        """Return a folder beside the cell file."""
        if not _FOLDER.fullmatch(name):
            raise SchemaError(
                f"{name!r:.70} is no name for a folder beside the cell file: letters, digits, -, _"
            )
        return self._path.resolve().parent / name


def _asked(
    kind: type[Any], work: Callable[[Any], Mapping[str, object]], message: object
) -> Mapping[str, object]:
    """Carry out an action, or refuse its message in one line."""
    try:
        return work(from_data(kind, message, "message"))
    except OSError as error:
        if isinstance(error, ElastocalError):
            raise
        raise SchemaError(f"{error.strerror or error}") from error


def _shown(figures: object) -> Mapping[str, object]:
    return {"posture": to_data(figures)}


def _bounded(ends: Any, revolute: tuple[bool, ...], sign: float) -> list[float]:
    """Return limits for a slider: a turn, or 10 m, where there is none."""
    return [
        float(end) if np.isfinite(end) else sign * (np.pi if turns else 10.0)
        for end, turns in zip(ends, revolute, strict=True)
    ]
