import numpy as np
import pytest

from elastocal.cell import SensorLoad
from elastocal.compensation.online import Compensator, Reading, Status
from elastocal.compensation.online.state import rkorr
from elastocal.procedure.derive.tool import RawWrench, wrench_on_robot
from support.compensated import arm, load, settings

Q = [0.3, -0.8, 1.2, 0.4, -0.7, 0.2]
# Springs at Hartenberg-Denavit origins have longer levers: these pushes deflect the arm by 3.1 mm.
PLAIN = {
    "deadband": "0 mm",
    "filter": {"median": 1, "low_pass": None},
    "limits": {"correction": "5 mm"},
}
CYCLE = 0.004


def plain(**changes):
    return Compensator.of(arm(), settings(**(PLAIN | changes)))


def fed(compensator, state, reading, times):
    """Return state and corrections of readings that come in time."""
    told = []
    for _ in range(times):
        reading = reading._replace(time=max(state.time, 0.0) + CYCLE)
        state, correction = compensator.step(state, reading)
        told.append(correction)
    return state, told


def pushed(f=(200.0, -300.0, -900.0), m=(10.0, 20.0, -5.0)):
    return Reading(0.0, Q, f, m)


def in_the_air(tool, R_base_tcp):
    """Return force and moment that a sensor reads of its tool alone."""
    weight = tool.response @ (tool.gravity @ R_base_tcp @ tool.T_tcp_sensor[:3, :3])
    bias = np.concatenate([tool.force_bias, tool.moment_bias])
    return np.split(np.linalg.solve(tool.matrix, weight) + bias, 2)


class TestCorrection:
    def test_it_is_minus_the_models_deflection_of_the_wrench_in_base(self):
        compensator = plain()
        _, told = fed(compensator, compensator.start(), pushed(), 100)
        model = arm().model
        R = model.robot.forward(Q)[:3, :3]
        expected = model.deflection(arm().compliance, Q, R @ (200, -300, -900), R @ (10, 20, -5))
        np.testing.assert_allclose(told[-1].deflection, expected, rtol=1e-12)
        np.testing.assert_allclose(told[-1].correction, -expected, rtol=1e-12)
        assert told[-1].status == Status.OK

    def test_in_the_tcp_frame_it_is_turned(self):
        base, tcp = plain(), plain(frame="tcp")
        _, in_base = fed(base, base.start(), pushed(), 100)
        _, in_tcp = fed(tcp, tcp.start(), pushed(), 100)
        R = arm().model.robot.forward(Q)[:3, :3]
        np.testing.assert_allclose(R @ in_tcp[-1].correction, in_base[-1].correction, rtol=1e-12)

    def test_in_a_controllers_frame_it_is_turned(self):
        turned = plain(frame={"abc": ["90 deg", "0 deg", "0 deg"]})
        base = plain()
        _, here = fed(turned, turned.start(), pushed(), 100)
        _, there = fed(base, base.start(), pushed(), 100)
        x, y, z = there[-1].correction
        np.testing.assert_allclose(here[-1].correction, (y, -x, z), rtol=1e-12)

    def test_gain_scales_it(self):
        half, full = plain(gain=0.5), plain()
        _, a = fed(half, half.start(), pushed(), 100)
        _, b = fed(full, full.start(), pushed(), 100)
        np.testing.assert_allclose(2.0 * np.array(a[-1].correction), b[-1].correction, rtol=1e-12)

    def test_tool_weight_and_bias_do_not_move_it(self):
        tool, robot = load(), arm().model.robot
        compensator = Compensator.of(arm(), settings(**PLAIN), tool)
        R = robot.forward(Q)[:3, :3]
        raw = Reading(0.0, Q, *in_the_air(tool, R))
        _, told = fed(compensator, compensator.start(), raw, 20)
        assert np.abs(told[-1].correction).max() < 1e-15

    def test_a_wrench_is_conditioned_as_the_equations_say(self):
        tool = load()
        compensator = Compensator.of(arm(), settings(**PLAIN), tool)
        state = compensator.condition(compensator.start(), pushed()._replace(time=1.0))
        state = compensator.condition(state, pushed()._replace(time=1.004))
        T = arm().model.robot.forward(Q)
        bias = in_the_air(tool, T[:3, :3])
        raw = RawWrench(np.array(pushed().force), np.array(pushed().moment), T)
        found = wrench_on_robot(raw, RawWrench(*bias, T), tool)
        expected = np.concatenate([found.force @ T[:3, :3], found.moment @ T[:3, :3]])
        np.testing.assert_allclose(state.wrench, expected, rtol=1e-12)

    def test_half_width_is_1_96_deviations_of_the_draws(self):
        compensator = plain()
        _, told = fed(compensator, compensator.start(), pushed(), 3)
        model, R = arm().model, arm().model.robot.forward(Q)[:3, :3]
        block = model.observation_blocks(Q, R @ (200, -300, -900), R @ (10, 20, -5))
        deviation = (block @ arm().draws.T).std(axis=1, ddof=1)
        assert told[-1].half_width == pytest.approx(1.959964 * deviation.max(), rel=1e-6)

    def test_rkorr_is_in_mm_and_leaves_the_orientation(self):
        assert rkorr((0.001, -0.0002, 0.0)) == pytest.approx((1.0, -0.2, 0.0, 0.0, 0.0, 0.0))


class TestLimits:
    def test_the_way_to_a_step_of_force_is_at_the_rate(self):
        compensator = plain()
        _, told = fed(compensator, compensator.start(), pushed(), 5)
        steps = np.diff([c.correction for c in told], axis=0)
        np.testing.assert_allclose(np.linalg.norm(steps[1:], axis=1), 0.03 * CYCLE, rtol=1e-9)
        assert told[-1].status & Status.RATE

    def test_more_than_the_limit_is_cut_to_it_in_the_same_direction(self):
        compensator = plain(limits={"correction": "0.1 mm", "rate": "30 mm/s", "fade": "5 mm/s"})
        _, told = fed(compensator, compensator.start(), pushed(), 50)
        correction, deflection = np.array(told[-1].correction), np.array(told[-1].deflection)
        assert np.linalg.norm(correction) == pytest.approx(1e-4, rel=1e-12)
        assert np.linalg.norm(np.cross(correction, deflection)) < 1e-20
        assert told[-1].status & Status.LIMITED

    @pytest.mark.parametrize(("share", "corrected"), [(0.9, 0.0), (1.5, 0.5), (2.5, 1.0)])
    def test_the_deadband_lets_go_gradually(self, share, corrected):
        free = plain()
        _, told = fed(free, free.start(), pushed(), 100)
        length = float(np.linalg.norm(told[-1].deflection))
        wide = {"correction": "10 mm", "rate": "100 mm/s"}
        band = plain(deadband=f"{1e3 * length / share:.12f} mm", limits=wide)
        _, told = fed(band, band.start(), pushed(), 100)
        assert np.linalg.norm(told[-1].correction) == pytest.approx(corrected * length, rel=1e-6)
        assert bool(told[-1].status & Status.DEADBAND) == (corrected < 1.0)

    def test_a_wide_interval_warns(self):
        narrow, wide = plain(uncertain_above="0.001 mm"), plain(uncertain_above="10 mm")
        _, a = fed(narrow, narrow.start(), pushed(), 3)
        _, b = fed(wide, wide.start(), pushed(), 3)
        assert a[-1].status & Status.UNCERTAIN
        assert not b[-1].status & Status.UNCERTAIN


BAD = {
    "NaN force": (pushed()._replace(force=(np.nan, 0.0, 0.0)), Status.INVALID),
    "infinite moment": (pushed()._replace(moment=(0.0, 0.0, np.inf)), Status.INVALID),
    "NaN joint": (pushed()._replace(q=[np.nan, *Q[1:]]), Status.INVALID),
    "joint in counts": (pushed()._replace(q=[1e6, *Q[1:]]), Status.INVALID),
    "beyond the range": (pushed()._replace(force=(0.0, 0.0, 2600.0)), Status.SATURATED),
    "moment beyond": (pushed()._replace(moment=(-400.0, 0.0, 0.0)), Status.SATURATED),
    "sensor says so": (pushed()._replace(ok=False), Status.SENSOR),
}


class TestFailure:
    @pytest.fixture
    def running(self):
        compensator = plain()
        state, told = fed(compensator, compensator.start(), pushed(), 100)
        return compensator, state, told[-1].correction

    @pytest.mark.parametrize("kind", BAD)
    def test_a_bad_reading_is_named_and_the_correction_held_then_faded(self, running, kind):
        compensator, state, held = running
        reading, flag = BAD[kind]
        state, told = fed(compensator, state, reading, 200)
        assert all(c.status & flag for c in told)
        assert all(c.correction == held and c.status & Status.HELD for c in told[:10])
        assert told[10].status & Status.FADED
        lengths = np.array([np.linalg.norm(c.correction) for c in told[10:]])
        going = lengths[:-1] > 0.005 * CYCLE
        np.testing.assert_allclose(np.diff(lengths)[going], -0.005 * CYCLE, rtol=1e-6)
        assert lengths[-1] == 0.0

    @pytest.mark.parametrize("advance", [0.0, -1.0, 3.0, np.nan, -np.inf])
    def test_a_time_that_does_not_advance_properly_is_stale(self, running, advance):
        compensator, state, held = running
        _, told = compensator.step(state, pushed()._replace(time=state.time + advance))
        assert told.correction == held
        assert told.status == Status.HELD | Status.STALE

    @pytest.mark.parametrize("jump", [-100.0, 1e9])
    def test_a_clock_that_is_set_anew_costs_one_reading(self, running, jump):
        compensator, state, _ = running
        state, _ = compensator.step(state, pushed()._replace(time=state.time + jump))
        _, told = compensator.step(state, pushed()._replace(time=state.time + CYCLE))
        assert told.status == Status.OK

    def test_it_comes_back_at_the_rate(self, running):
        compensator, state, _ = running
        state, _ = fed(compensator, state, BAD["NaN force"][0], 200)
        _, told = fed(compensator, state, pushed(), 3)
        steps = np.linalg.norm(np.diff([c.correction for c in told], axis=0), axis=1)
        np.testing.assert_allclose(steps, 0.03 * CYCLE, rtol=1e-9)

    def test_a_bad_reading_does_not_reach_the_filters(self):
        compensator = Compensator.of(arm(), settings())
        state, _ = fed(compensator, compensator.start(), pushed(), 50)
        after, _ = fed(compensator, state, BAD["NaN force"][0], 1)
        assert (after.window, after.memory, after.wrench) == (
            state.window,
            state.memory,
            state.wrench,
        )

    def test_joints_that_fail_between_reading_and_correction_hold_it(self, running):
        compensator, state, held = running
        state = compensator.condition(state, pushed()._replace(time=state.time + CYCLE))
        _, told = compensator.correct(state, [np.nan] * 6)
        assert told.correction == held
        assert told.status == Status.HELD | Status.INVALID

    def test_the_start_corrects_nothing(self):
        compensator = plain()
        _, told = compensator.correct(compensator.start(), Q)
        assert told.correction == (0.0, 0.0, 0.0)
        assert told.status == Status.FADED | Status.STALE


class TestFilter:
    def test_a_quicker_sensor_is_read_several_times_a_cycle(self):
        quick = settings(filter={"sample": "1 ms", "median": 3, "low_pass": {"cutoff": "15 Hz"}})
        compensator = Compensator.of(arm(), quick)
        state, time = compensator.start(), 0.0
        for _ in range(200):
            for _ in range(4):
                time += 0.001
                state = compensator.condition(state, pushed()._replace(time=time))
            state, told = compensator.correct(state, Q)
        slow = plain()
        _, expected = fed(slow, slow.start(), pushed(), 100)
        np.testing.assert_allclose(told.deflection, expected[-1].deflection, rtol=1e-6)

    @pytest.mark.parametrize(("median", "spikes"), [(3, 1), (5, 2)])
    def test_a_median_stops_spikes(self, median, spikes):
        chain = {"median": median, "low_pass": None}
        compensator = Compensator.of(arm(), settings(**(PLAIN | {"filter": chain})))
        state, _ = fed(compensator, compensator.start(), pushed(), 20)
        before = state.wrench
        spike = pushed(f=(2000.0, 2000.0, 2000.0))
        for reading in [spike] * spikes + [pushed()] * 5:
            state, _ = fed(compensator, state, reading, 1)
            assert state.wrench == before

    def test_a_step_keeps_the_state_it_was_given(self):
        compensator = Compensator.of(arm(), settings())
        state, _ = fed(compensator, compensator.start(), pushed(), 5)
        again = fed(compensator, state, pushed(), 3)
        assert fed(compensator, state, pushed(), 3) == again


def test_a_sensor_load_must_be_finite():
    from elastocal.errors import CompensationError

    with pytest.raises(CompensationError, match="force_bias of the tool must be finite"):
        SensorLoad(force_bias=np.array([np.nan, 0.0, 0.0]))


class TestAfterAGap:
    """Filters remember the wrench before a gap; once that correction has faded, so must they."""

    @pytest.fixture
    def filtered(self):
        compensator = Compensator.of(arm(), settings())
        state, _ = fed(compensator, compensator.start(), pushed(), 400)
        return compensator, state

    def test_no_correction_comes_back_when_the_force_has_gone(self, filtered):
        compensator, state = filtered
        state, told = fed(compensator, state, pushed()._replace(ok=False), 400)
        assert told[-1].correction == (0.0, 0.0, 0.0)
        _, told = fed(compensator, state, pushed((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), 50)
        assert max(np.linalg.norm(each.correction) for each in told) == 0.0

    def test_what_the_filters_say_fades_with_the_correction(self, filtered):
        compensator, state = filtered
        before = np.linalg.norm(state.correction)
        after, told = fed(compensator, state, pushed()._replace(ok=False), 30)
        share = np.linalg.norm(told[-1].correction) / before
        assert 0.1 < share < 0.9
        np.testing.assert_allclose(after.wrench, share * np.array(state.wrench), rtol=1e-9)
        for old, new in zip(state.memory, after.memory, strict=True):
            np.testing.assert_allclose(new, share * np.array(old), rtol=1e-9)

    def test_a_gap_that_is_held_changes_nothing(self, filtered):
        compensator, state = filtered
        after, told = fed(compensator, state, pushed()._replace(ok=False), 5)
        assert told[-1].status & Status.HELD
        assert (after.wrench, after.memory) == (state.wrench, state.memory)


class TestCourses:
    LIGHT = ((0.0, 0.0, -60.0), (0.0, 0.0, 0.0))
    SHOWN = np.array([2e-4, -1e-4, 3e-4])

    def begun(self, shown=SHOWN, **changes):
        """Return a compensator, and its state in light contact before and after a beginning."""
        compensator = plain(**changes)
        state, told = fed(compensator, compensator.start(), pushed(*self.LIGHT), 100)
        begun = compensator.begin_course(state, Q, told[-1].deflection + np.array(shown))
        return compensator, state, begun

    def test_what_the_marker_shows_beyond_the_deflection_is_corrected_over_the_course(self):
        compensator, _, state = self.begun()
        plain_state, _ = fed(compensator, compensator.start(), pushed(*self.LIGHT), 100)
        _, without = fed(compensator, plain_state, pushed(), 200)
        _, told = fed(compensator, state, pushed(), 200)
        moved = np.subtract(told[-1].correction, without[-1].correction)
        np.testing.assert_allclose(moved, -self.SHOWN, atol=1e-15)
        assert told[-1].deflection == without[-1].deflection
        _, gone = fed(compensator, compensator.end_course(state), pushed(), 200)
        np.testing.assert_allclose(gone[-1].correction, without[-1].correction, atol=1e-15)

    def test_it_goes_in_at_the_rate_and_the_limit_holds_for_the_sum(self):
        limits = {"correction": "0.25 mm", "rate": "10 mm/s", "fade": "5 mm/s"}
        compensator, before, state = self.begun(limits=limits)
        _, told = fed(compensator, state, pushed(*self.LIGHT), 40)
        way = np.array([before.correction, *(each.correction for each in told)])
        assert np.linalg.norm(np.diff(way, axis=0), axis=1).max() <= 1e-5 * 10 * CYCLE * 1e3
        assert np.linalg.norm(way, axis=1).max() <= 0.25e-3 * (1.0 + 1e-12)
        assert told[-1].status & Status.LIMITED

    @pytest.mark.parametrize(
        "shown", [(np.nan, 0.0, 0.0), (0.0, np.inf, 0.0), (1.1e-3, 0.0, 0.0), (1e308, 1e308, 0.0)]
    )
    def test_what_is_no_offset_is_refused_and_the_one_before_stays(self, shown):
        compensator, _, state = self.begun()
        refused = compensator.begin_course(state, Q, shown)
        assert refused.offset == state.offset
        _, told = fed(compensator, refused, pushed(), 5)
        assert told[-1].status & Status.OFFSET
        assert compensator.begin_course(refused, Q, self.SHOWN).refused == 0

    @pytest.mark.parametrize("fault", [{"ok": False}, {"force": (np.nan, 0.0, 0.0)}])
    def test_without_a_wrench_nothing_is_known_of_an_offset(self, fault):
        compensator, state, _ = self.begun()
        bad = pushed(*self.LIGHT)._replace(time=state.time + CYCLE, **fault)
        state, _ = compensator.step(state, bad)
        begun = compensator.begin_course(state, Q, self.SHOWN)
        assert begun.refused == Status.OFFSET
        assert begun.offset == (0.0, 0.0, 0.0)

    def test_nothing_begins_before_the_first_reading(self):
        compensator = plain()
        assert compensator.begin_course(compensator.start(), Q, self.SHOWN).refused

    def test_it_fades_with_the_correction_when_readings_fail(self):
        compensator, _, state = self.begun()
        state, _ = fed(compensator, state, pushed(*self.LIGHT), 50)
        state, told = fed(compensator, state, pushed(*self.LIGHT)._replace(ok=False), 600)
        assert told[-1].correction == (0.0, 0.0, 0.0)
        # The arm may be elsewhere when readings come again.
        assert state.offset == (0.0, 0.0, 0.0)
