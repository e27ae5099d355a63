"""``live``: what it refuses, what it does with an arm that is not there, and what it writes."""

import gc
import json
import sys

import numpy as np
import pytest
import yaml

from elastocal import workflows
from elastocal.cell import AnswerTimes, DeviceSet, PathLimits, load_cell
from elastocal.errors import CompensationError, DeviceError, RobotError, UnitError
from elastocal.identification import read_model
from elastocal.procedure.derive.touches import TaughtMarkers
from support import compensated, live_bench
from support.cli import elastocal
from support.live_bench import DRIVER


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("live")
    cell = live_bench.write_cell(folder / "cell.yaml")
    return cell, live_bench.write_model_of(cell, folder / "model.json")


@pytest.fixture(autouse=True)
def _driver(tmp_path, monkeypatch):
    live_bench.install(tmp_path / "installed", monkeypatch)
    DRIVER.force, DRIVER.rate = (0.0, 0.0, 0.0), 1000.0


def after(cycles: int):
    """Return what interrupts after some cycles."""
    return lambda: DRIVER.arm is not None and len(DRIVER.arm.answers) > cycles


def correct(files, **changed):
    cell, model = files
    usual = {"arm": True, "interrupted": after(400)}
    return workflows.live(cell, model=model, **(usual | changed))


def test_nothing_starts_without_arm_and_the_limits_are_told(files):
    DRIVER.arm = None
    with pytest.raises(DeviceError, match=r"up to 2 mm at up to 20 mm/s; give --arm"):
        correct(files, arm=False)
    assert DRIVER.arm is None


def test_a_model_is_taken_as_a_file_or_as_it_was_read(files):
    with pytest.raises(DeviceError, match="give --arm"):
        correct((files[0], read_model(files[1])), arm=False)


def test_nothing_starts_without_limits_in_the_cell_file(files, tmp_path):
    cell = live_bench.write_cell(
        tmp_path / "cell.yaml", arm={"driver": "live_bench", "limits": False}
    )
    with pytest.raises(DeviceError, match="states no limits"):
        correct((cell, files[1]))


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({}, "no largest_correction and no correction_speed"),
        ({"largest_correction": "2 mm"}, "states no correction_speed"),
        ({"mode": "contact"}, "mode is contact: must be compensation"),
    ],
)
def test_a_kuka_needs_limits_that_somebody_has_chosen(files, tmp_path, keys, said):
    arm = {"driver": "kuka_rsi", "mode": "compensation"} | keys
    cell = live_bench.write_cell(tmp_path / "cell.yaml", arm=arm)
    with pytest.raises(DeviceError, match=said):
        correct((cell, files[1]))


def test_an_arm_that_takes_no_corrections_is_refused(files, tmp_path):
    cell = live_bench.write_cell(tmp_path / "cell.yaml", arm="simulated")
    with pytest.raises(DeviceError, match="'simulated' takes no corrections of a path"):
        correct((cell, files[1]))


def test_a_sensor_without_a_newest_wrench_is_refused(files, monkeypatch):
    monkeypatch.setattr(DRIVER, "connect", lambda *_: DeviceSet(sensor=DRIVER), raising=False)
    with pytest.raises(DeviceError, match=r"devices\.sensor: driver 'live_bench' gives no newest"):
        correct(files)


def test_the_model_of_another_robot_is_refused(files, tmp_path):
    data = yaml.safe_load(files[0].read_text())
    data["tcp"]["xyz"][2] = "500 mm"
    cell = tmp_path / "cell.yaml"
    cell.write_text(yaml.safe_dump(data))
    with pytest.raises(RobotError, match="another tool centre point, base or robot"):
        correct((cell, files[1]))


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"cycle": "12 ms"}, r"cycle is 0\.012: must be 0\.004"),
        ({"frame": "tcp"}, "frame is tcp: must be base"),
        ({"limits": {"correction": "3 mm"}}, r"limits\.correction is 3 mm: at most 2"),
        ({"limits": {"correction": "1 mm", "rate": "25 mm/s"}}, r"rate is 25 mm/s: at most 20"),
    ],
)
def test_settings_are_within_what_the_cell_allows(files, tmp_path, changed, said):
    path = tmp_path / "online.yaml"
    path.write_text(yaml.safe_dump({"schema": "elastocal.compensator/1"} | changed))
    with pytest.raises(CompensationError, match=said):
        correct(files, compensator=path)


def test_the_range_of_the_sensor_is_the_cells_unless_the_settings_say_it(files, tmp_path):
    cell, limits = load_cell(files[0]), PathLimits(2e-3, 0.02, 0.004, "base")
    path = tmp_path / "online.yaml"
    text = "schema: elastocal.compensator/1\nlimits: {correction: 1 mm, rate: 20 mm/s}\n"
    path.write_text(text)
    for file in (None, path):
        found = workflows.settings_within(file, limits, cell).sensor
        assert found.force == cell.file.sensor.force_range
        assert found.moment == cell.file.sensor.moment_range
    path.write_text(f"{text}sensor: {{force: [900 N, 900 N, 900 N]}}\n")
    assert workflows.settings_within(path, limits, cell).sensor.force == (900.0,) * 3


def test_filters_have_the_rate_of_the_cycle_or_of_the_sensor(files, tmp_path):
    path = tmp_path / "online.yaml"
    limits = {"correction": "1 mm", "rate": "20 mm/s"}
    data = {"limits": limits, "filter": {"sample": "2 ms"}}
    path.write_text(yaml.safe_dump({"schema": "elastocal.compensator/1"} | data))
    with pytest.raises(CompensationError, match=r"sample is 2 ms: .* sends 1000 a second"):
        correct(files, compensator=path)


@pytest.mark.parametrize("duration", ["0 s", "-3", "soon", "5 mm"])
def test_a_duration_is_a_time(files, duration):
    with pytest.raises(UnitError):
        correct(files, duration=duration)


def test_it_ends_by_a_fade_and_its_record_says_what_was(files, tmp_path):
    told, reports = [], []
    out = tmp_path / "out"

    def interrupted():
        # The bias has been taken by then: something presses.
        DRIVER.force = (0.0, 0.0, -500.0 if after(300)() else 0.0)
        return after(900)()

    result = correct(
        files, out=out, interrupted=interrupted, report=reports.append, warn=told.append
    )
    answers = DRIVER.arm.answers
    assert answers[-1] is None
    shifts = np.array([each for each in answers if each is not None])
    assert np.abs(shifts).max() > 1e-5
    np.testing.assert_array_equal(shifts[-1], np.zeros(3))
    assert np.linalg.norm(np.diff(shifts, axis=0), axis=1).max() <= 0.02 * live_bench.CYCLE * 1.001
    assert (result.ended, result.problem) == ("interrupted", None)
    assert result.loop.cycles == result.logged + result.dropped
    assert result.line is live_bench.STATISTICS
    assert any("no tool file" in text for text in told)
    assert reports[0].sentence().startswith("0 s ")
    record = json.loads((out / "live.json").read_text())
    assert record["schema"] == "elastocal.live/1"
    assert record["line"]["late"] == 2
    assert record["loop"]["cycles"] == result.loop.cycles
    assert {each.name for each in out.iterdir()} == {"live.json", "live.mcap"}
    assert "record of a live compensation" in checked(out / "live.json")
    assert f"cycles: {result.logged}" in checked(out / "live.mcap")


def checked(path):
    found = elastocal("check", path)
    assert found.code == 0, found.err
    return " ".join(found.err.split())


def test_a_log_that_was_cut_off_is_refused(files, tmp_path):
    correct(files, out=tmp_path / "out")
    log = tmp_path / "out" / "live.mcap"
    log.write_bytes(log.read_bytes()[:-100])
    assert "live.mcap is a damaged MCAP file" in elastocal("check", log).reason


def test_it_ends_when_its_time_is_over(files):
    result = correct(files, duration=0.2, interrupted=lambda: False)
    assert result.ended == "the duration is over"
    assert result.seconds >= 0.2


def test_python_is_kept_out_of_the_way_only_meanwhile(files):
    seen = []
    switch = sys.getswitchinterval()
    correct(files, report=lambda _: seen.append((gc.isenabled(), sys.getswitchinterval())))
    assert seen[0][0] is False
    assert seen[0][1] < switch
    assert gc.isenabled()
    assert sys.getswitchinterval() == switch


def test_ctrl_c_is_an_end_and_not_a_traceback(files):
    def interrupt():
        if after(100)():
            raise KeyboardInterrupt
        return False

    result = correct(files, interrupted=interrupt)
    assert result.ended == "interrupted"
    assert DRIVER.arm.answers[-1] is None


def test_a_line_that_breaks_leaves_a_record_and_a_problem(files, tmp_path):
    cell = live_bench.write_cell(
        tmp_path / "cell.yaml", arm={"driver": "live_bench", "cycles": 150}
    )
    out = tmp_path / "out"
    result = correct((cell, files[1]), out=out, interrupted=lambda: False)
    assert result.problem == "bench: the line broke"
    assert json.loads((out / "live.json").read_text())["problem"] == result.problem
    told = elastocal("live", cell, "--model", files[1], "--arm", "--duration", "5 s", "--json")
    assert told.code == 1
    assert json.loads(told.out)["problem"] == result.problem
    assert told.err.strip().splitlines()[-1] == "elastocal: bench: the line broke"


def test_times_are_counted_to_five_microseconds_whatever_their_number():
    times, rng = AnswerTimes(), np.random.default_rng(0)
    drawn = rng.lognormal(-8.5, 0.5, 20_000)
    for each in drawn.tolist():
        times.add(each)
    for share in (0.5, 0.99, 0.999):
        assert times.quantile(share) == pytest.approx(np.quantile(drawn, share), abs=1.1e-5)
    assert times.longest == drawn.max()
    assert AnswerTimes().quantile(0.5) is None


class TestCourses:
    """Offsets of courses: the tool says when one begins, the tracker what it is."""

    LEVER, TAUGHT = np.array([0.1, 0.0, -0.1]), np.array([2e-4, 1e-4, -3e-4])
    MOVED = np.array([1e-4, -5e-5, 8e-5])

    @pytest.fixture
    def landed(self, request, tmp_path, files, monkeypatch):
        """Return what makes a live compensation of a tool that lands, and the cell's arm."""
        tracker = getattr(request, "param", "live_bench")
        cell = live_bench.write_cell(tmp_path / "cell.yaml", metrology=tracker)
        described = load_cell(cell)
        T = described.robot.forward(described.home)
        station = described.file.trackers[0].name

        def taught(folders):
            assert folders == (tmp_path / "taught",)
            place = T[None, :3, 3] + np.array([0.0, 0.0, 5e-3])
            return TaughtMarkers(
                described.robot, place, self.TAUGHT[None], np.eye(4), station, self.LEVER
            )

        monkeypatch.setattr(sys.modules["elastocal.workflows.live"], "read_taught_markers", taught)
        DRIVER.marker = T[:3, 3] + T[:3, :3] @ self.LEVER + self.TAUGHT + self.MOVED
        light = described.file.procedure.contact_force

        def correct(marker=DRIVER.marker):
            DRIVER.marker, begun = marker, DRIVER.time

            def lands() -> bool:
                passed = DRIVER.time - begun
                pressed = 15.0 * light if passed < 6.0 else light
                DRIVER.force = (0.0, 0.0, 0.0 if passed < 3.0 else -pressed)
                return passed > 15.0

            return workflows.live(
                cell,
                model=files[1],
                arm=True,
                taught=(tmp_path / "taught",),
                interrupted=lands,
            )

        return correct, described

    def test_what_the_tracker_shows_in_light_contact_is_corrected_within_the_limits(self, landed):
        correct, described = landed
        loop = correct().loop
        assert (loop.courses, loop.offsets_refused) == (1, 0)
        # What the light contact bends is predicted, and no part of the offset.
        model = compensated.calibrated(described.robot)
        R = described.robot.forward(described.home)[:3, :3]
        force = R @ np.array([0.0, 0.0, -described.file.procedure.contact_force])
        bent = model.model.deflection(model.compliance, described.home, force)
        assert loop.largest_offset == pytest.approx(np.linalg.norm(self.MOVED - bent), rel=0.05)
        assert loop.largest_step <= 0.02 * 0.004 * (1.0 + 1e-9)

    def test_an_offset_beyond_any_is_refused_and_a_tracker_that_is_silent_ends_nothing(
        self, landed
    ):
        correct, _ = landed
        far = correct(DRIVER.marker + np.array([0.0, 5e-3, 0.0]))
        assert (far.loop.courses, far.loop.offsets_refused) == (0, 1)
        assert far.loop.largest_offset == 0.0
        assert dict(far.facts())["courses"].endswith("1 offsets refused")
        silent = correct(None)
        assert silent.ended == "interrupted"
        assert silent.problem is None
        assert (silent.loop.courses, silent.loop.offsets_refused) == (0, 0)
        assert any("gave no offset of their own: the tracker gave 0" in n for n in silent.notes)

    @pytest.mark.parametrize("landed", ["simulated"], indirect=True)
    def test_a_simulated_tracker_beside_another_arm_is_refused_before_it_moves(self, landed):
        correct, _ = landed
        DRIVER.arm = None
        with pytest.raises(DeviceError, match="'simulated' is simulated: it does not see this arm"):
            correct()
        assert DRIVER.arm is None
