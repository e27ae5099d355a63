"""What a page can ask of a session: figures of postures, edits, work."""

import base64
import multiprocessing
import threading
from types import SimpleNamespace

import numpy as np
import pytest

from elastocal import workflows
from elastocal.cell import load_cell, write_example
from elastocal.errors import FileAccessError, ProcedureError, RobotError, SchemaError
from elastocal.robot import xyzabc_from_T
from elastocal.studio import Session, default_springs
from elastocal.studio.cell_edit import form_of
from elastocal.studio.posture import CellView
from elastocal.studio.recorded import RunView, find_runs
from elastocal.studio.springs import _caveats
from elastocal.studio.worker import Outbox, Worker, WorkState
from elastocal.wording import in_words
from elastocal.workflows.studio import _Commands, _PageOperator
from support import live_bench
from support.recorded_runs import record_run
from support.run_cells import planned_cell
from support.tasks import ask_twice, fail, tick_until_stopped


class Commands:
    """The work of commands, of which none is done."""

    real = False

    check = _Commands.check

    def springs(self, cell):
        return default_springs(cell)

    def is_real(self, _cell):
        return self.real

    def plan(self, _cell, _message):
        raise AssertionError("nobody planned")

    run = watch = plan


@pytest.fixture
def session(tmp_path):
    (path, *_) = write_example(tmp_path / "cell", "afp")
    return Session(path, Commands())


@pytest.fixture(scope="module")
def view(tmp_path_factory):
    (path, *_) = write_example(tmp_path_factory.mktemp("afp"), "afp")
    cell = load_cell(path)
    return CellView.of(cell, default_springs(cell))


def test_the_deflection_is_that_of_the_model_at_the_tool(view):
    q = view.cell.home
    found = view.at(q)
    R = view.cell.robot.forward(q)[:3, :3]
    levels = view.cell.file.load_cases.levels
    springs = view.springs
    for case in found.cases:
        expected = springs.model.deflection(springs.compliance, q, R @ levels[case.name])
        assert case.deflection == pytest.approx(expected, abs=1e-12)
        assert case.size == f"{1e3 * np.linalg.norm(expected):.3f} mm"
    assert "not calibrated" in springs.source


def test_margins_are_those_of_planning(view):
    plain = view.at(view.cell.home)
    names = [each.name for each in plain.checks]
    assert names == [in_words(check.name) for check in view.builder.solver.checks.all]
    assert plain.joints[0].margin == "1500.0 mm"
    bent = np.array(view.cell.home)
    bent[5] = view.cell.robot.limits.upper[5] - np.radians(1.0)
    joint = view.at(bent).joints[5]
    assert (joint.margin, joint.passes) == ("1.0°", False)


def test_joints_beyond_their_limits_are_set_to_them(view):
    q = np.array(view.cell.home)
    q[1] = 100.0
    assert view.at(q).q[1] == pytest.approx(view.cell.robot.limits.upper[1])
    with pytest.raises(RobotError):
        view.at([0.0])


def test_the_tool_goes_where_it_is_dragged_and_stays_where_it_cannot(view):
    T = view.cell.robot.forward(view.cell.home)
    T[:3, 3] += (0.05, -0.1, 0.05)
    found = view.towards(view.cell.home, T)
    assert view.cell.robot.forward(found.q) == pytest.approx(T, abs=1e-6)
    assert found.refusal == ""
    T[:3, 3] += 20.0
    stays = view.towards(view.cell.home, T)
    assert stays.q == pytest.approx(view.cell.home)
    assert "out of reach" in stays.refusal


def test_a_press_is_a_pose_that_planning_would_take(view):
    found = view.press(view.cell.home, (1.85, 0.1, 3.0), (0.0, 0.0, -2.0))
    assert found.refusal == ""
    assert found.surface.startswith("on the tooling, 0.0°")
    assert all(each.passes for each in found.checks)
    edge = view.press(view.cell.home, (1.85, 0.55, 3.0), (0.0, 0.0, -1.0))
    assert edge.refusal == "" or "refused by" in edge.refusal


def test_a_press_moves_the_rail_only_where_it_must_and_says_so(view):
    line = (1.85, 0.1, 3.0), (0.0, 0.0, -2.0)
    stays = view.press(view.cell.home, *line)
    assert (stays.q[0], stays.note) == (view.cell.home[0], "")
    far = np.array(view.cell.home)
    far[0] = view.cell.robot.limits.lower[0]
    moved = view.press(far, *line)
    assert moved.q[0] != far[0]
    assert moved.note.startswith("rail moved from ")
    assert f"to {1e3 * moved.q[0]:.1f} mm" in moved.note


@pytest.mark.parametrize(
    ("near", "load", "said"),
    [(True, True, ""), (False, True, "this posture was"), (True, False, "this load was"),
     (False, False, "posture and load were")],
)  # fmt: skip
def test_an_interval_has_its_caveat_where_nothing_was_calibrated(near, load, said):
    rows = SimpleNamespace(near=np.array([near]), within_load=np.array([load]))
    model = SimpleNamespace(covered_rows=lambda *_: rows)
    (caveat,) = _caveats(model, np.zeros((1, 6)), np.zeros((1, 3)))
    assert caveat == (said and f"{said} not calibrated: the interval may not hold here")


def test_an_edit_is_written_with_its_comments_and_seen(session):
    before = session.actions["scene"]({})
    text = before["text"]
    loads = before["form"]["loads"] | {"fz": "900 N"}
    assert session.actions["edit"]({"loads": loads}) == {"changed": True}
    after = session.actions["scene"]({})
    assert after["text"] == text.replace('fz: "1100 N"', 'fz: "900 N"')
    assert after["number"] == before["number"] + 1
    assert "0, 0, -900 N" in [case["force"] for case in after["posture"]["cases"]]
    assert session.actions["edit"]({"loads": loads}) == {"changed": False}


def test_stations_region_and_home_are_edited(session):
    form = session.actions["scene"]({})["form"]
    more = {"name": "station_2", "position": ["1 m", "2 m", "3 m"], "range": ["1 m", "15 m"]}
    session.actions["edit"]({"stations": [*form["stations"], more]})
    region = {"min": ["-0.2 m"] * 3, "max": ["0.2 m"] * 3}
    session.actions["edit"]({"region": region})
    home = session.actions["scene"]({})["home"]
    home[1] = 0.1
    session.actions["edit"]({"home": home})
    found = session.actions["scene"]({})
    layers = {layer["label"]: layer["parts"][0] for layer in found["scene"]["layers"]}
    assert layers["Tracker stations"]["texts"] == ["station_1", "station_2"]
    edges = np.frombuffer(base64.b64decode(layers["Region of the tooling"]["ends"]), "<f4")
    assert edges.shape == (12 * 2 * 3,)
    assert found["form"]["region"] == region
    assert found["home"][1] == pytest.approx(0.1, abs=1e-3)
    assert "# in base" in found["text"]
    session.actions["edit"]({"stations": form["stations"], "whole_surface": True})
    assert session.actions["scene"]({})["form"]["region"] is None


@pytest.mark.parametrize(
    "edit",
    [
        {"text": "schema: elastocal.cell/1\n"},
        {"loads": {"fx": "1 N", "fy": "1 N", "fz": "900", "level": "", "cases": ["normal"]}},
        {"loads": {"fx": "1 N", "fy": "1 N", "fz": "9 N", "level": "", "cases": []}},
        {"region": {"min": ["50 m"] * 3, "max": ["51 m"] * 3}},
        {"stations": [{"name": "a", "position": ["1", "2", "3"], "range": ["1 m", "2 m"]}]},
        {"home": [0.0]},
        {"house": 1},
    ],
)
def test_what_would_not_pass_check_is_refused_and_nothing_written(session, tmp_path, edit):
    path = tmp_path / "cell" / "cell.yaml"
    before = path.read_bytes()
    with pytest.raises((SchemaError, ValueError)) as refusal:
        session.actions["edit"](edit)
    assert ".elastocal-" not in str(refusal.value)
    assert path.read_bytes() == before
    assert {each.name for each in path.parent.iterdir()} == {
        "cell.yaml",
        "dome.stl",
        "process.csv",
    } & {each.name for each in path.parent.iterdir()}


def test_a_file_that_somebody_else_changed_is_not_overwritten(session, tmp_path):
    path = tmp_path / "cell" / "cell.yaml"
    path.write_text(path.read_text() + "\n# mine\n")
    loads = session.actions["scene"]({})["form"]["loads"] | {"fz": "900 N"}
    with pytest.raises(SchemaError, match="changed by somebody else"):
        session.actions["edit"]({"loads": loads})
    session.actions["reload"]({})
    session.actions["edit"]({"loads": loads})
    assert path.read_text().endswith("# mine\n")
    assert form_of(load_cell(path)).loads.fz == "900 N"


@pytest.mark.parametrize("folder", ["../out", "/tmp/out", "", ".hidden", "a/b", "x" * 100])
def test_folders_lie_beside_the_cell_file(session, folder):
    for action, message in (
        ("plan", {"folder": folder}),
        ("record", {"folder": folder}),
        ("poses", {"folder": folder}),
        ("run", {"plan": "plan", "folder": folder}),
        ("run", {"plan": folder, "folder": "run"}),
    ):
        with pytest.raises(SchemaError, match="no name for a folder"):
            session.actions[action](message)


@pytest.mark.parametrize(
    ("armed", "confirmed", "reason"),
    [(False, True, "started with --arm"), (True, False, "not confirmed")],
)
def test_nothing_real_moves_without_being_armed_and_confirmed(tmp_path, armed, confirmed, reason):
    (path, *_) = write_example(tmp_path / "cell", "afp")
    commands = Commands()
    commands.real = True
    session = Session(path, commands, armed)
    with pytest.raises(ProcedureError, match=reason):
        session.actions["run"]({"plan": "plan", "folder": "run", "confirmed": confirmed})
    assert session.worker.news.state is WorkState.NONE


def worked(kind, work, stop=False):
    """Return the last news of a work."""
    busy, ended = threading.Event(), threading.Event()

    def changed():
        if worker.news.stage == "ticking":
            busy.set()
        if worker.news.state not in (WorkState.NONE, WorkState.BUSY):
            ended.set()

    worker = Worker(changed)
    worker.begin(kind, work)
    if stop:
        assert busy.wait(60.0)
        with pytest.raises(ProcedureError, match="still going on"):
            worker.begin(kind, work)
        worker.stop()
    assert ended.wait(60.0)
    worker.close()
    return worker.news


def test_a_run_that_is_stopped_comes_to_its_own_end():
    news = worked("run", tick_until_stopped, stop=True)
    assert (news.state, news.result) == (WorkState.STOPPED, {"ended": "well"})
    assert news.live == {"heard": "stop"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("second", "state", "result"),
    [
        (lambda worker: worker.answer(2), WorkState.DONE, {"ended": "well"}),
        (lambda worker: worker.stop(), WorkState.STOPPED, {"ended": "stopped", "at": 2}),
    ],
)
def test_a_run_waits_for_the_answer_to_its_own_question(second, state, result):
    """A second click on the button of the first question does not answer the next."""
    asked, ended = {1: threading.Event(), 2: threading.Event()}, threading.Event()

    def changed():
        if "question" in worker.news.live:
            asked[worker.news.live["question"]].set()
        if worker.news.state not in (WorkState.NONE, WorkState.BUSY):
            ended.set()

    worker = Worker(changed)
    worker.begin("run", ask_twice)
    assert asked[1].wait(60.0)
    worker.answer(1)
    worker.answer(1)
    assert asked[2].wait(60.0)
    assert not ended.wait(0.2)
    second(worker)
    assert ended.wait(60.0)
    worker.close()
    assert (worker.news.state, worker.news.result) == (state, result)


def test_other_work_ends_at_once():
    news = worked("plan", tick_until_stopped, stop=True)
    assert (news.state, news.message, news.result) == (WorkState.STOPPED, "stopped", {})


def test_a_work_that_fails_says_why():
    news = worked("plan", fail)
    assert (news.state, news.message) == (WorkState.FAILED, "it cannot be done")


@pytest.mark.slow
def test_work_may_begin_when_other_work_has_ended():
    news = []
    worker = Worker(lambda: news.append(worker.news))
    for kind in ("plan", "survey"):
        worker.begin(kind, fail)
        worker._reader.join(60.0)
    worker.close()
    ended = [each.kind for each in news if each.state is WorkState.FAILED]
    assert ended == ["plan", "survey"]


def test_a_run_on_disk_is_opened_pose_by_pose(tmp_path):
    run = record_run(tmp_path / "run", poses=2)
    found = RunView.read(run.path)
    assert found.live  # its journal has no last entry
    told = found.summary()
    assert [each["pose"] for each in told["poses"]] == [0, 1]
    assert all(len(set(line.split())) == len(line.split()) for line in told["last"]), told["last"]
    pose = found.pose(1)
    time, force = (np.array(pose["force"][key]) for key in ("time", "value"))
    windows = {
        each["name"]: (time >= each["start"]) & (time <= each["end"]) for each in pose["windows"]
    }
    pressed = run.plan.contact.load_cases["normal"]
    expected = np.linalg.norm(pressed)
    assert force[windows["normal"]].mean() == pytest.approx(expected, rel=0.05)
    assert force[windows["unloaded"]].mean() < 5.0
    assert len(pose["q"]) == len(pose["time"]) > 10
    with pytest.raises(ProcedureError, match="pose 99 is not committed"):
        found.pose(99)


def test_runs_are_listed_those_that_cannot_be_read_with_the_reason(tmp_path):
    record_run(tmp_path / "run", poses=1)
    (tmp_path / "torn").mkdir()
    (tmp_path / "torn" / "journal.jsonl").write_text("nonsense\n")
    good, torn = find_runs(tmp_path)
    assert (good.folder, good.state, good.live) == ("run", "1 pose committed, goes on", True)
    assert "line 1" in torn.state
    with pytest.raises(ProcedureError, match="holds no run"):
        RunView.read(tmp_path)


class Listener:
    """A line to a studio that keeps what it hears, and says stop after so many samples."""

    def __init__(self, most):
        self.samples, self.told, self._most = [], [], most

    def progress(self, *_):
        pass

    def sample(self, live):
        self.samples.append(live)

    def tell(self, live):
        self.told.append(live)

    def stopped(self):
        return len(self.samples) >= self._most


class Asking:
    """A page whose works are done at once, in this process."""

    def __init__(self, path, model):
        self.path, self.session = path, Session(path, _Commands(model))
        self.session.worker.begin = self._do

    def _do(self, _kind, work):
        self._result = work(self.heard)

    def ask(self, action, most=1, **message):
        """Return the result of the work that an action begins, and what was heard of it."""
        self.heard = Listener(most)
        self.session.actions[action](message)
        return self._result, self.heard

    def look(self, action, **message):
        """Return what an action shows."""
        return self.session.actions[action](message)


@pytest.fixture(scope="module")
def asking(tmp_path_factory):
    path = planned_cell(tmp_path_factory.mktemp("asking"), poses=3).cell
    return Asking(path, live_bench.write_model_of(path, path.with_name("model.json")))


@pytest.mark.slow
def test_a_survey_and_a_comparison_are_made_of_the_pool_of_the_cell(asking):
    found, _ = asking.ask("survey")
    free = [p for p, name in zip(found["points"], found["refused"], strict=True) if not name]
    assert len(free) == 40
    assert found["summary"].startswith(f"40 of {len(found['points'])} points can be pressed on")
    compared, _ = asking.ask("compare")
    rows = {each["technique"]: each for each in compared["rows"]}
    assert {each["poses"] for each in rows.values()} == {"3"}
    radius = {name: float(each["covering_radius"].split()[0]) for name, each in rows.items()}
    assert radius["cover"] == min(radius.values())
    assert float(rows["ioops"]["o1"]) == max(float(each["o1"]) for each in rows.values())


def test_the_devices_are_heard_until_somebody_says_stop(asking):
    _, heard = asking.ask("watch", most=2)
    shown = heard.samples[-1]
    kinds = [each["device"].split()[0] for each in shown["devices"]]
    assert kinds == ["arm", "sensor", "metrology"]
    assert {len(each["cells"]) for each in shown["devices"]} == {len(shown["columns"])}


@pytest.mark.slow
def test_a_plan_is_made_shown_and_run_and_a_run_that_is_stopped_can_be_gone_on_with(asking):
    made, _ = asking.ask("plan", folder="planned")
    shown = asking.look("poses", **made)
    assert shown["summary"].startswith("3 poses by ")
    assert [each["id"] for each in shown["poses"]] == [0, 1, 2]
    with pytest.raises(FileAccessError, match="planned"):
        asking.ask("plan", folder="planned")
    stopped, heard = asking.ask("run", most=2, plan="planned", folder="run", rate=20.0)
    assert stopped["interrupted"]
    assert heard.samples[-1]["next"]
    assert asking.look("folders")["plans"] == ["planned"]
    (run,) = asking.look("folders")["runs"]
    assert "interrupted" in run["state"]
    assert "AT THE SURFACE" not in run["state"]
    assert len(asking.look("record", folder="run")["poses"]) < 3
    beside = asking.path.parent
    left = workflows.dry_run(asking.path, plan=beside / "planned", out=beside / "run")
    assert left.poses == 3


def test_a_page_sees_postures_places_and_news(asking):
    scene = asking.look("scene")
    q, T = scene["home"], np.reshape(scene["posture"]["tcp"], (4, 4))
    assert asking.look("posture", q=q)["posture"]["q"] == q
    abc = xyzabc_from_T(T)[3:].tolist()
    there = asking.look("place", q=q, position=T[:3, 3].tolist(), orientation=abc)["posture"]
    assert there["tcp"] == pytest.approx(scene["posture"]["tcp"], abs=1e-9)
    kept = asking.look("place", q=q, position=T[:3, 3].tolist())["posture"]
    assert kept["tcp"] == pytest.approx(there["tcp"], abs=1e-9)
    number, told = asking.session.news(-1, 0.0)
    assert (told["work"]["state"], told["cell"]) == ("none", scene["number"])
    assert asking.session.news(number, 0.0) == (number, told)


def test_the_springs_of_a_model_have_an_interval_and_say_where_it_holds(asking):
    scene = asking.look("scene")
    assert scene["springs"].startswith("calibrated model model.json")
    (case, *_) = scene["posture"]["cases"]
    assert case["size"].endswith(" mm")
    assert case["caveat"].endswith("the interval may not hold here")


def test_the_view_opens_on_arm_and_tooling_and_not_on_the_floor(view):
    """A floor of 12 m by 12 m stands below them."""
    camera, up = view.scene.cameras[0], view.scene.up
    shown = [view.surface.mesh.vertices]
    for part in view.scene.layers[0].parts:
        T = view.scene.places[0, part.part]
        shown.append(part.solid.vertices @ T[:3, :3].T + T[:3, 3])
    ahead = (camera.centre - camera.eye) / np.linalg.norm(camera.centre - camera.eye)
    right = np.cross(ahead, up) / np.linalg.norm(np.cross(ahead, up))
    seen = np.concatenate(shown) - camera.eye
    edge = (seen @ ahead) * np.tan(np.radians(22.5))
    high, wide = seen @ np.cross(right, ahead) / edge, seen @ right / edge / 1.5
    part_of_picture = np.abs([high, wide]).max()
    assert 0.75 < part_of_picture < 1.0


def test_the_operator_at_a_page_is_asked_there():
    ours, theirs = multiprocessing.Pipe()
    operator = _PageOperator(Outbox(theirs), [], [], 0.0)
    assert operator.answers
    with operator.supervise(1) as supervision:
        first = supervision.ask("put the second disk on")
        assert ours.recv() == ("live", {"asked": "put the second disk on", "question": 1})
        assert not first()
        ours.send(("answer", 1))
        assert first()
        second = supervision.ask("take it off")
        assert not second()
        ours.send("stop")
        assert supervision.interrupted()
        assert not second()
