"""The loop with a cell whose answer is known: a spring of 1 N/µm in every direction."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from elastocal.compensation.process import (
    Controller,
    Course,
    Landing,
    Passage,
    PerfectCorrector,
    air_shifts,
    run_courses,
)
from elastocal.compensation.process.course import Ripple
from elastocal.errors import CompensationError
from elastocal.sim.arm.measurement import START
from support.cells import robot

COMPLIANCE = 1e-6
PROMPT = Controller(dead_cycles=0, lag=0.0)


@dataclass(frozen=True)
class Pressed:
    shift: np.ndarray
    wrench: np.ndarray
    felt: np.ndarray
    gears: np.ndarray


class Spring:
    """A cell that yields in proportion, sags by a millimetre, and tells what it was asked."""

    def __init__(self) -> None:
        self.joints: list[np.ndarray] = []

    def lift(self, course, q):  # noqa: ARG002
        self.joints.clear()

    def free_shift(self, q):
        return np.broadcast_to([0.0, 0.0, -1e-3], (*q.shape[:-1], 3))

    def press(self, q, force, path_base=None, outward_base=None):  # noqa: ARG002
        self.joints.append(q[0])
        self.pressed = force
        felt = np.concatenate([force, np.zeros_like(force)], axis=-1)
        gears = 1e-6 * force[..., :1] * np.ones_like(q)
        return Pressed(self.free_shift(q) + COMPLIANCE * force, felt + 5.0, felt, gears)

    def read_links(self, q, gears):  # noqa: ARG002
        return None

    def read(self, since, wrench):  # noqa: ARG002
        return wrench

    def taught(self, q, time, visits):  # noqa: ARG002
        return np.broadcast_to([0.0, 0.0, 1e-4], (len(q), 3))

    def marker(self, time):  # noqa: ARG002
        return np.array([[0.0, 3e-4, 1e-4]] * len(self.pressed)) + COMPLIANCE * self.pressed


class Landed(PerfectCorrector):
    """Corrects the offset of its course alone, and keeps what it was told of it."""

    def start(self) -> None:
        super().start()
        self.offset, self.force = np.zeros(3), []

    def correct(self, cycle):
        self.force.append(cycle.raw[-1, 0] - 5.0)
        return -self.offset

    def begin_course(self, q, deviation):  # noqa: ARG002
        self.offset = deviation


class Seeing(Spring):
    """The same arm with secondary encoders at its last joints."""

    def read_links(self, q, gears):
        return (q + gears)[..., -2:]


class Listener(PerfectCorrector):
    """Corrects nothing, and keeps the readings."""

    def __init__(self) -> None:
        super().__init__(0)
        self.time, self.raw, self.links, self.zeroed = [], [], [], None

    def zero_encoders(self):
        self.zeroed = len(self.links)

    def correct(self, cycle):
        self.time.append(cycle.time)
        self.raw.append(cycle.raw)
        self.links.append(None if cycle.links is None else cycle.links - cycle.q[-2:])
        return np.zeros(3)


def course(force: np.ndarray, ripple: tuple[Ripple, ...] = ()) -> Course:
    """A course that stands still, pressed along x; the deviation counts along x."""
    rows = len(force)
    q = np.tile(np.asarray(START, dtype=float), (rows, 1))
    along_x = np.tile([1.0, 0.0, 0.0], (rows, 1))
    T = robot().forward(q)
    return Course("made up", 0.04, T, force[:, None] * along_x, along_x, ripple, q)


def run(controller, corrector, force=None, ripple=()):
    cell, made = Spring(), course(np.linspace(0.0, 500.0, 26) if force is None else force, ripple)
    passage = Passage(made, air_shifts(cell, made), corrector)
    return run_courses(cell, robot(), [passage], controller)[0], cell


def test_without_correction_the_deviation_is_the_deflection_without_the_sag():
    passage, _ = run(PROMPT, None)
    np.testing.assert_allclose(passage.deviation, COMPLIANCE * 500.0 * passage.time, rtol=1e-9)
    assert len(passage.time) == 250


def test_a_perfect_corrector_without_delay_leaves_nothing():
    passage, _ = run(PROMPT, PerfectCorrector(0))
    np.testing.assert_allclose(passage.deviation, 0.0, atol=1e-12)


@pytest.mark.parametrize(("filters", "dead"), [(0, 3), (4, 0), (4, 3)])
def test_delay_leaves_the_slope_times_the_delay(filters, dead):
    passage, _ = run(Controller(dead_cycles=dead, lag=0.0), PerfectCorrector(filters))
    slope = COMPLIANCE * 500.0
    np.testing.assert_allclose(passage.deviation[20:], slope * 0.004 * (filters + dead), rtol=1e-9)


def test_a_lead_by_the_whole_delay_leaves_nothing_of_a_ramp():
    passage, _ = run(Controller(dead_cycles=3, lag=0.0), PerfectCorrector(4, lead=7.0))
    assert np.abs(passage.deviation[20:]).max() < 1e-9 * np.abs(COMPLIANCE * 500.0) + 1e-12


def test_a_lag_leaves_the_slope_times_its_time_constant():
    lag = 0.05
    passage, _ = run(Controller(dead_cycles=0, lag=lag), PerfectCorrector(0))
    cycle = 0.004
    steady = cycle * np.exp(-cycle / lag) / (1.0 - np.exp(-cycle / lag))
    np.testing.assert_allclose(passage.deviation[-20:], COMPLIANCE * 500.0 * steady, rtol=1e-3)


def test_courses_side_by_side_are_run_as_each_alone():
    forces = [np.linspace(0.0, 500.0, 26), np.linspace(0.0, -300.0, 9), np.full(14, 200.0)]
    ripples = [(), (Ripple(100.0, 0.5),), ()]
    correctors = [None, PerfectCorrector(2), PerfectCorrector(4, lead=3.0)]
    delayed = Controller(dead_cycles=3, lag=0.01)
    courses = [course(force, ripple) for force, ripple in zip(forces, ripples, strict=True)]
    cell = Spring()
    passages = [
        Passage(made, air_shifts(cell, made), corrector)
        for made, corrector in zip(courses, correctors, strict=True)
    ]
    found = run_courses(cell, robot(), passages, delayed)
    for each, passage in zip(found, passages, strict=True):
        (alone,) = run_courses(cell, robot(), [passage], delayed)
        assert len(alone.time) == 10 * (len(passage.course.q) - 1)
        np.testing.assert_allclose(each.shift, alone.shift, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(each.deviation, alone.deviation, rtol=0.0, atol=1e-12)


def test_a_landing_presses_and_reads_what_the_marker_shows_in_light_contact():
    cell, corrector = Spring(), Landed(0)
    made = [course(np.full(30, force)) for force in (100.0, 40.0)]
    made = [replace(each, normal=each.direction) for each in made]
    landing = Landing(light=20.0, ramp=500.0, settle=0.1, average=0.2)
    correctors = corrector, Landed(0)
    passages = [
        Passage(each, air_shifts(cell, each), one)
        for each, one in zip((made[0], *made), (None, *correctors), strict=True)
    ]
    bare, first, second = run_courses(cell, robot(), passages, PROMPT, landing)
    assert landing.seconds(made[0]) == pytest.approx(0.2 + 0.16 + 0.3)
    forces = np.array(corrector.force)
    assert forces.max() == pytest.approx(100.0)
    assert forces[110:160] == pytest.approx(20.0)
    # What the reference shows along z goes; the 20 N of the light contact are in the reading.
    for each in correctors:
        np.testing.assert_allclose(each.offset, [20e-6, 3e-4, 0.0], atol=1e-12)
    np.testing.assert_allclose(bare.shift[-1], [100e-6, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(first.shift[-1], [80e-6, -3e-4, 0.0], atol=1e-12)
    np.testing.assert_allclose(second.shift[-1], [20e-6, -3e-4, 0.0], atol=1e-12)


def test_courses_at_other_steps_of_time_cannot_go_side_by_side():
    cell, made = Spring(), course(np.full(6, 100.0))
    both = [Passage(each, air_shifts(cell, each)) for each in (made, replace(made, step=0.02))]
    with pytest.raises(CompensationError, match="same step of time"):
        run_courses(cell, robot(), both, Controller())


def test_the_robot_is_commanded_to_where_the_correction_says():
    _, cell = run(PROMPT, PerfectCorrector(0), force=np.full(10, 400.0))
    moved = robot().forward(cell.joints[-1]) - robot().forward(cell.joints[0])
    np.testing.assert_allclose(moved[:3, 3], [-400.0 * COMPLIANCE, 0.0, 0.0], atol=1e-7)
    np.testing.assert_allclose(moved[:3, :3], 0.0, atol=1e-6)


def test_readings_come_four_times_a_cycle_with_the_ripple_on_the_process_part_only():
    listener = Listener()
    run(Controller(sample=0.001), listener, np.full(6, 100.0), (Ripple(100.0, 0.5),))
    time, raw = np.concatenate(listener.time), np.concatenate(listener.raw)
    np.testing.assert_allclose(np.diff(time), 0.001, rtol=1e-9)
    assert {len(block) for block in listener.raw} == {4}
    expected = 5.0 + 100.0 * (1.0 + 0.5 * np.sin(2.0 * np.pi * 100.0 * time))
    np.testing.assert_allclose(raw[:, 0], expected, rtol=1e-9)
    np.testing.assert_allclose(raw[:, 1], 5.0)


def test_encoders_are_zeroed_in_the_air_and_read_in_every_cycle():
    listener, cell, made = Listener(), Seeing(), course(np.full(6, 100.0))
    run_courses(cell, robot(), [Passage(made, air_shifts(cell, made), listener)], PROMPT)
    assert listener.zeroed >= 100
    np.testing.assert_allclose(listener.links[: listener.zeroed], 0.0, atol=1e-15)
    # The force rises from the air to the first row in the cycles before it.
    np.testing.assert_allclose(listener.links[-1], 100e-6, rtol=1e-9)
    assert np.all(np.diff(np.concatenate(listener.time)) > 0.0)


def test_a_sample_time_that_does_not_divide_the_cycle_is_refused():
    with pytest.raises(CompensationError, match=r"filter.sample 0.003 s does not divide"):
        Controller(sample=0.003)


def test_a_cycle_that_does_not_divide_the_rows_is_refused():
    with pytest.raises(CompensationError, match=r"cycle 0.007 s does not divide the 0.04 s"):
        run(Controller(cycle=0.007, sample=0.007), None)
