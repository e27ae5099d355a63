"""The loop of a live compensation, with an arm and a sensor that are told what to say."""

import json
from dataclasses import dataclass, field

import numpy as np
import pytest
from mcap.reader import make_reader

from elastocal.cell import PathCycle, SensorLoad, SensorStatus, WrenchSample
from elastocal.compensation.online import (
    Compensator,
    LiveCycle,
    LiveLog,
    LiveLoop,
    LivePhase,
    Status,
    Tare,
    design,
    newest_sample,
)
from elastocal.compensation.online.live import LiveSample
from elastocal.errors import DeviceError
from support import compensated

CYCLE = 0.004
Q = [0.1, -0.8, 1.0, 0.2, 0.7, 0.3]
PRESSING = (40.0, -30.0, -600.0)


@dataclass
class Bench:
    """A loop whose arm stands still and whose sensor says what a test wants."""

    tares: bool = False
    free: float = np.inf
    load: SensorLoad = field(default_factory=SensorLoad)
    force: tuple = PRESSING
    streams: bool = True
    refuses: str = ""
    status: SensorStatus = SensorStatus.OK

    def __post_init__(self) -> None:
        settings = compensated.settings(deadband="0 mm", limits={"correction": "3 mm"})
        numbers = design(compensated.arm(), settings, self.load)
        tare = (
            Tare(numbers.load, numbers.functions().orientation, self.free) if self.tares else None
        )
        self.settings, self.time = settings, 10.0
        self.sample = None
        self.cycles: list[LiveCycle] = []
        self.loop = LiveLoop(Compensator(numbers), newest_sample(self), tare, self.cycles.append)

    def newest(self):
        if self.refuses:
            raise DeviceError(self.refuses)
        return self.sample

    def step(self, begins: bool = False, q=Q, **facts):
        self.time += CYCLE
        if self.streams:
            force, moment = np.array(self.force), np.array([1.0, 2.0, 0.5])
            self.sample = WrenchSample(self.time - 5e-4, force, moment, self.status)
        return self.loop.correction(PathCycle(self.time, q, begins, **facts))

    def run(self, seconds: float, **changed) -> np.ndarray:
        """Return the corrections of some cycles, in mm."""
        for key, value in changed.items():
            setattr(self, key, value)
        return np.array([1e3 * np.array(self.step()) for _ in range(round(seconds / CYCLE))])


def steps(corrections: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.diff(corrections, axis=0), axis=1)


def started(**changed) -> Bench:
    bench = Bench(**changed)
    bench.step(begins=True)
    bench.run(1.0)
    return bench


def test_a_wrench_is_corrected_against_the_deflection_of_the_model():
    bench = started()
    calibrated = compensated.arm()
    model = calibrated.model
    R = model.robot.forward(Q)[:3, :3]
    expected = -model.deflection(
        calibrated.compliance, np.array(Q), R @ np.array(PRESSING), R @ np.array([1.0, 2.0, 0.5])
    )
    np.testing.assert_allclose(bench.cycles[-1].correction, expected, rtol=1e-6)
    assert bench.loop.phase is LivePhase.CORRECTING
    counts = bench.loop.counts()
    assert (counts.corrected, counts.held, counts.restarts) == (counts.cycles - 1, 0, 1)


def test_without_a_stream_for_a_second_the_correction_is_held_faded_and_never_jumps():
    bench = started()
    still = np.array(bench.cycles[-1].correction) * 1e3
    gone = bench.run(1.0, streams=False)
    held = round(bench.settings.hold / CYCLE)
    np.testing.assert_allclose(gone[:held], np.tile(still, (held, 1)))
    fade = 1e3 * bench.settings.limits.fade * CYCLE
    assert np.all(steps(gone) <= fade * (1 + 1e-9))
    assert np.all(np.diff(np.linalg.norm(gone, axis=1)) <= 0.0)
    np.testing.assert_array_equal(gone[-1], np.zeros(3))
    back = bench.run(1.0, streams=True)
    np.testing.assert_allclose(back[-1], still, rtol=1e-4)
    rate = 1e3 * bench.settings.limits.rate * CYCLE
    assert steps(np.vstack([gone[-1:], back])).max() <= rate * (1 + 1e-9)
    counts = bench.loop.counts()
    assert counts.held == held
    assert counts.faded + held >= 250
    assert counts.largest_step * 1e3 <= rate * (1 + 1e-9)


def test_a_sensor_that_refuses_is_faded_out_and_named():
    bench = started()
    gone = bench.run(1.0, refuses="Net F/T at 10.0.0.5: status 0x80000001")
    np.testing.assert_array_equal(gone[-1], np.zeros(3))
    assert "status 0x80000001" in bench.loop.refusal
    assert bench.cycles[-1].status & Status.SENSOR
    assert bench.loop.counts().refused == 250
    bench.run(0.1, refuses="")
    assert bench.loop.refusal == ""
    assert np.any(bench.cycles[-1].correction)


def test_a_bad_status_is_held_faded_and_followed_again_at_the_rate():
    bench = started()
    still = np.array(bench.cycles[-1].correction) * 1e3
    gone = bench.run(1.0, status=SensorStatus.FAULT)
    np.testing.assert_array_equal(gone[-1], np.zeros(3))
    assert bench.cycles[-1].status & Status.SENSOR
    assert bench.loop.refusal == "it calls its newest sample bad"
    back = bench.run(1.0, status=SensorStatus.OK)
    np.testing.assert_allclose(back[-1], still, rtol=1e-4)
    rate = 1e3 * bench.settings.limits.rate * CYCLE
    assert steps(np.vstack([gone[-1:], back])).max() <= rate * (1 + 1e-9)
    assert bench.loop.refusal == ""


def test_it_goes_on_from_the_correction_that_the_arm_has():
    bench = started()
    effect = (1e-4, 0.0, 0.0)
    assert bench.step(effect=effect, holds=True) == effect
    moved = bench.step(effect=effect)
    rate = bench.settings.limits.rate * CYCLE
    assert 0.0 < np.linalg.norm(np.subtract(moved, effect)) <= rate * (1 + 1e-9)


def test_the_end_fades_at_its_rate_and_then_there_is_no_correction():
    bench = started()
    bench.loop.finish()
    faded = []
    while (shift := bench.step()) is not None:
        faded.append(1e3 * np.array(shift))
        assert len(faded) < 1000
    assert steps(np.array(faded)).max() <= 1e3 * bench.settings.limits.fade * CYCLE * (1 + 1e-9)
    np.testing.assert_array_equal(faded[-1], np.zeros(3))
    assert bench.loop.over.is_set()
    assert bench.loop.phase is LivePhase.OVER
    assert bench.step() is None


def test_a_program_that_was_started_anew_begins_at_zero():
    bench = started()
    first = np.array(bench.step(begins=True))
    assert np.linalg.norm(first) <= bench.settings.limits.rate * CYCLE
    assert bench.loop.counts().restarts == 2


def test_joints_that_are_none_hold_the_correction():
    bench = started()
    before = bench.cycles[-1].correction
    assert bench.step(q=[np.nan] * 6) == before
    assert bench.cycles[-1].status & Status.INVALID


def test_a_large_load_never_exceeds_the_limit():
    bench = started(force=(0.0, 0.0, -2400.0))
    counts = bench.loop.counts()
    assert counts.limited > 0
    assert counts.largest_correction <= 0.003 * (1 + 1e-9)


def test_the_bias_is_taken_in_the_air_and_nothing_is_corrected_before():
    tool = SensorLoad(mass=20.0, centre=np.array([0.0, 0.0, 0.1]))
    bench = Bench(tares=True, load=tool)
    R = compensated.arm().model.robot.forward(Q)[:3, :3]
    weight = tool.weight(R)
    bias = np.array([5.0, -3.0, 2.0])
    bench.force = tuple(bias + weight[:3])
    bench.step(begins=True)
    assert not np.any(bench.run(0.4))
    assert bench.loop.phase is LivePhase.TARING
    bench.run(0.5)
    assert bench.loop.phase is LivePhase.CORRECTING
    np.testing.assert_allclose(bench.loop._tare.bias[:3], bias, atol=1e-9)
    np.testing.assert_allclose(bench.cycles[-1].wrench[:3], 0.0, atol=1e-6)


def test_no_bias_is_taken_while_something_shakes_the_tool():
    bench = Bench(tares=True)
    rng = np.random.default_rng(0)
    bench.step(begins=True)
    for _ in range(300):
        bench.run(CYCLE, force=tuple(rng.normal(0.0, 30.0, 3)))
    assert bench.loop._tare.bias is None
    assert bench.loop._tare.scatter[0] > 10.0
    assert not np.any([cycle.correction for cycle in bench.cycles])
    bench.run(1.1, force=(0.0, 0.0, 0.0))
    assert bench.loop._tare.bias is not None


def test_a_press_at_the_beginning_is_no_bias():
    bench = Bench(tares=True, free=150.0)
    bench.step(begins=True)
    bench.run(1.0)
    assert bench.loop._tare.bias is None
    assert "602 N beyond the tool's weight, at most 150 N" in bench.loop.refusal
    assert not np.any([cycle.correction for cycle in bench.cycles])
    bench.run(1.1, force=(3.0, 0.0, -4.0))
    assert bench.loop.refusal == ""
    assert bench.loop._tare.bias[:3] == pytest.approx((3.0, 0.0, -4.0))


def test_a_sensor_that_was_zeroed_with_its_tool_has_a_bias_as_large_as_the_tool():
    bench = Bench(tares=True, free=150.0, load=SensorLoad(mass=60.0), force=(2.0, -3.0, 1.0))
    bench.step(begins=True)
    bench.run(1.0)
    assert np.linalg.norm(bench.loop._tare.bias[:3]) > 500.0
    assert bench.loop.refusal == ""


def test_what_is_not_measured_anew_is_no_reading_of_the_bias():
    bench = Bench(tares=True)
    bench.step(begins=True)
    bench.run(2.0, streams=False)
    assert bench.loop._tare.bias is None


def cycle_at(time: float) -> LiveCycle:
    sample = LiveSample(time, (1.0, 2.0, float("nan")), (0.0, 0.0, 0.0), True)
    return LiveCycle(time, Q, sample, (0.5,) * 6, (1e-4,) * 3, 1e-5, (-1e-4,) * 3, 64 | 1)


def test_the_log_holds_every_cycle_and_says_what_it_is(tmp_path):
    names = [f"joint_a{k}" for k in range(1, 7)]
    log = LiveLog(tmp_path / "live.mcap", names, {"robot": "KR"})
    log.start()
    for k in range(200):
        log.put(cycle_at(0.004 * k))
    log.close()
    assert (log.written, log.dropped, log.failure) == (200, 0, "")
    with (tmp_path / "live.mcap").open("rb") as file:
        reader = make_reader(file)
        facts = next(reader.iter_metadata()).metadata
        found = [(message.log_time, json.loads(message.data)) for *_, message in
                 reader.iter_messages()]  # fmt: skip
    assert facts["schema"] == "elastocal.live-log/1"
    assert facts["robot"] == "KR"
    assert len(found) == 200
    time, last = found[-1]
    assert time == 796_000_000
    assert last["q"]["joint_a2"] == pytest.approx(-0.8)
    assert last["force"] == {"x": 1.0, "y": 2.0, "z": None}
    assert last["flags"] == "held stale"


def test_a_log_that_cannot_follow_drops_cycles_and_counts_them(tmp_path):
    log = LiveLog(tmp_path / "live.mcap", [], {}, most=10)
    for k in range(25):
        log.put(cycle_at(0.004 * k)._replace(q=()))
    assert log.dropped == 15
    log.start()
    log.close()
    assert (log.written, log.dropped) == (10, 15)


def test_a_full_disk_ends_the_log_and_not_the_loop(tmp_path):
    log = LiveLog(tmp_path / "live.mcap", [], {})

    class Full:
        def write(self, _data):
            raise OSError(28, "No space left on device")

        def __enter__(self):
            return self

        def __exit__(self, *_):
            log_file.close()

    log_file, log._file = log._file, Full()
    log.start()
    log._thread.join(10.0)
    log.put(cycle_at(1.0))
    log.close()
    assert log.failure == "No space left on device"
    assert log.dropped == 1


def test_the_offset_of_a_course_comes_and_goes_at_the_rate():
    bench = started()
    before = np.array(bench.run(0.1)[-1])
    shown = np.array([2e-4, 0.0, -1e-4])
    bench.loop.begin_course(tuple(shown))
    begun = bench.run(0.5)
    np.testing.assert_allclose(begun[-1] - before, -1e3 * shown, atol=1e-6)
    largest = 1e3 * bench.settings.limits.rate * CYCLE * (1.0 + 1e-9)
    assert steps(begun).max() <= largest
    bench.loop.end_course()
    ended = bench.run(0.5)
    np.testing.assert_allclose(ended[-1], before, atol=1e-6)
    assert steps(ended).max() <= largest
    counts = bench.loop.counts()
    assert (counts.courses, counts.offsets_refused) == (1, 0)
    assert counts.largest_offset == pytest.approx(np.linalg.norm(shown))


def test_an_offset_that_is_none_or_comes_without_a_wrench_is_refused_and_counted():
    bench = started()
    before = bench.run(0.1)[-1]
    for deviation in ((np.nan, 0.0, 0.0), (5e-3, 0.0, 0.0)):
        bench.loop.begin_course(deviation)
        np.testing.assert_allclose(bench.run(0.2)[-1], before, atol=1e-9)
    assert bench.cycles[-1].status & Status.OFFSET
    bench.streams = False
    bench.run(0.02)
    bench.loop.begin_course((1e-4, 0.0, 0.0))
    bench.run(0.5)  # held first, which keeps it, and then faded
    assert bench.loop.counts().offsets_refused == 3
    assert bench.loop.counts().courses == 0


def test_a_program_that_begins_anew_has_no_offset():
    bench = started()
    shown = np.array([2e-4, 0.0, 0.0])
    bench.loop.begin_course(tuple(shown))
    bench.run(0.5)
    bench.loop.begin_course((1e-4, 0.0, 0.0))
    bench.step(begins=True)
    expected = started()
    np.testing.assert_allclose(bench.run(1.0)[-1], expected.run(0.1)[-1], atol=1e-6)
