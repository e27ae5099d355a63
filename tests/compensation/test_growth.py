"""How far an arm has grown, from touches by other equations: links grow by shares of their own."""

import json
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

from elastocal.compensation import (
    CompensatorSettings,
    Touches,
    arm_growth,
    read_arm_growth,
    write_arm_growth,
)
from elastocal.compensation.online import Compensator, Reading, design
from elastocal.errors import CompensationError, RobotError, SchemaError
from elastocal.robot import Robot, catalogue
from support import compensated
from support.virtual_chain import ARMS

TIMES = ("2026-11-01T06:00:00+00:00", "2026-11-02T06:00:00+00:00", 160.0)
NOISE = 25e-6


def arm() -> Robot:
    return catalogue.load("KR 210 R2700-2")


def grown(robot: Robot, shares: np.ndarray) -> Robot:
    """Return a robot whose links have grown, each by a share of its own length."""
    joints = []
    for joint, share in zip(robot.chain.joints, shares, strict=True):
        placement = joint.placement.copy()
        placement[:3, 3] *= 1.0 + share
        joints.append(replace(joint, placement=placement))
    return replace(robot, chain=replace(robot.chain, joints=tuple(joints)))


def postures(count: int, seed: int) -> np.ndarray:
    """Return postures before the arm, some 0.5 m apart."""
    rng = np.random.default_rng(seed)
    return np.radians([0, -60, 90, 0, 45, 0]) + rng.uniform(-0.25, 0.25, (count, 6))


def touched(warm: Robot, count: int = 12, seed: int = 0, **changes) -> Touches:
    robot, q = arm(), postures(count, seed)
    rng = np.random.default_rng(seed + 100)
    shift = (warm.forward(q) - robot.forward(q))[:, :3, 3] + NOISE * rng.normal(size=(count, 3))
    normal = np.tile([-1.0, 0.0, 0.0], (count, 1))
    by_contact = -shift[:, 0] + NOISE * rng.normal(size=count)
    made = Touches(tuple(range(count)), q, shift, normal, by_contact)
    return replace(made, **changes)


def state_of(touches: Touches):
    return arm_growth(arm(), touches, cell="cell", times=TIMES)


def test_it_predicts_what_links_that_grow_unevenly_do_elsewhere():
    ratios = []
    for seed in range(10):
        shares = np.random.default_rng(seed).uniform(5e-6, 35e-6, 6)
        warm = grown(arm(), shares)
        state, q = state_of(touched(warm, seed=seed)), postures(200, seed + 50)
        true = (warm.forward(q) - arm().forward(q))[:, :3, 3]
        left = np.linalg.norm(true - state.shift(arm(), q), axis=1)
        without = np.linalg.norm(true, axis=1)
        assert state.corrects
        ratios.append(left.mean() / without.mean())
    assert np.mean(ratios) < 0.4
    assert max(ratios) < 0.6


@pytest.mark.slow
def test_the_interval_of_the_share_holds_the_share_of_an_arm_that_grows_evenly():
    share, inside = 20e-6, 0
    warm = grown(arm(), np.full(6, share))
    offset = share * arm().chain.T_last_tip[:3, 3]
    assert np.linalg.norm(offset) < 10e-6
    for seed in range(40):
        state = state_of(touched(warm, seed=seed))
        inside += abs(state.share - share) < state.share_half_width
    assert inside >= 35


def test_it_corrects_nothing_where_nothing_has_grown():
    found = [state_of(touched(arm(), seed=seed)) for seed in range(10)]
    idle = [each for each in found if not each.corrects]
    assert len(idle) >= 6
    assert all("the state corrects nothing" in each.findings[0] for each in idle)
    # Where chance looks like growth, it is no more than the noise of the touches.
    q = postures(50, 3)
    assert all(np.linalg.norm(e.shift(arm(), q), axis=1).max() < 3 * NOISE for e in found)


def test_a_tracker_that_moved_is_told_from_an_arm_that_grew():
    sound = touched(grown(arm(), np.full(6, 20e-6)))
    assert state_of(sound).findings == ()
    # The tooling says what the arm did; the tracker besides what happened to its stand.
    moved = replace(sound, shift=sound.shift + np.array([0.4e-3, 0.0, 0.0]))
    (finding,) = state_of(moved).findings
    assert "the tooling shows" in finding
    assert finding.kind == "arm.tracker-or-tooling-moved"


@pytest.mark.parametrize(
    ("touches", "message"),
    [
        (touched(arm(), 2), "2 points were touched in both runs: at least 3 are needed"),
        (
            touched(arm(), shift=np.full((12, 3), 5e-3)),
            r"the touches say that the arm has grown by .* are an arm's: did the tracker",
        ),
    ],
)
def test_what_no_arm_does_is_refused(touches, message):
    with pytest.raises(CompensationError, match=message):
        state_of(touches)


def test_a_state_of_another_arm_is_refused(tmp_path):
    path = tmp_path / "state.json"
    write_arm_growth(path, state_of(touched(grown(arm(), np.full(6, 20e-6)))))
    assert read_arm_growth(path, arm()).corrects
    with pytest.raises(CompensationError, match="not of KR 120"):
        read_arm_growth(path, catalogue.load("KR 120 R2500 pro"))


def test_a_changed_file_is_refused(tmp_path):
    path = tmp_path / "state.json"
    write_arm_growth(path, state_of(touched(grown(arm(), np.full(6, 20e-6)))))
    data = json.loads(path.read_text())
    path.write_text(json.dumps(data | {"share": 3.0 * data["share"]}))
    with pytest.raises(SchemaError, match="content_sha256"):
        read_arm_growth(path, arm())


@pytest.mark.parametrize("date", ["yesterday", "2026-11-02T06:00:00", ""])
def test_a_date_that_is_none_is_refused_in_a_line(tmp_path, date):
    path = tmp_path / "state.json"
    write_arm_growth(path, state_of(touched(grown(arm(), np.full(6, 20e-6)))))
    data = json.loads(path.read_text())
    del data["content_sha256"]
    path.write_text(json.dumps(data | {"warm": date}))
    with pytest.raises(
        SchemaError, match=r"state\.json: warm .* is no date and time with its zone"
    ):
        read_arm_growth(path, arm())


def test_a_robot_that_cannot_be_read_is_refused_by_its_file(tmp_path):
    path = tmp_path / "state.json"
    write_arm_growth(path, state_of(touched(grown(arm(), np.full(6, 20e-6)))))
    data = json.loads(path.read_text())
    del data["content_sha256"]
    path.write_text(json.dumps(data | {"robot": data["robot"] | {"tcp": "nowhere"}}))
    with pytest.raises(RobotError, match=r"state\.json: .*nowhere"):
        read_arm_growth(path, arm())


def test_what_was_found_is_said_wherever_the_state_corrects():
    sound = touched(grown(arm(), np.full(6, 20e-6)))
    moved = state_of(replace(sound, shift=sound.shift + np.array([0.4e-3, 0.0, 0.0])))
    growth, finding = moved.notes(datetime(2026, 11, 2, 7, tzinfo=UTC))
    assert "corrections hold the growth" in growth
    assert "one of them has moved" in finding


def test_a_state_that_corrects_nothing_says_so_and_not_that_corrections_hold_it():
    found = [state_of(touched(arm(), seed=seed)) for seed in range(10)]
    idle = next(each for each in found if not each.corrects)
    (note,) = idle.notes(datetime(2026, 11, 2, 7, tzinfo=UTC))
    assert "the state corrects nothing" in note


def test_an_old_state_says_so():
    state = state_of(touched(grown(arm(), np.full(6, 20e-6))))
    (fresh,) = state.notes(datetime(2026, 11, 2, 7, tzinfo=UTC))
    _, old = state.notes(datetime(2026, 11, 4, 6, tzinfo=UTC))
    assert "as touched at 2026-11-02T06:00:00" in fresh
    assert old == "the state of the arm is 48 h old: touch again"
    # A clock that is set wrong on either machine says nothing of how old it is.
    _, early = state.notes(datetime(2026, 11, 1, 6, tzinfo=UTC))
    assert early == "the state of the arm is -24 h old: touch again"


class TestFoot:
    def test_it_is_the_origin_of_the_first_joint_of_the_arm(self):
        robot = arm()
        np.testing.assert_array_equal(
            robot.foot(np.zeros(6)), robot.chain.joints[0].placement[:3, 3]
        )

    @pytest.mark.parametrize("name", ["on a rail", "offset wrist on a turntable"])
    def test_it_moves_with_the_axes_before_the_arm(self, name):
        robot = Robot.from_urdf(ARMS[name], "tcp")
        assert robot.external_axes
        first = robot.chain.joints[robot.external_axes]
        q = np.random.default_rng(0).uniform(-0.5, 0.5, (5, len(robot.joint_names)))
        # Where a chain that ends before the arm, at the same place, brings its tip.
        T = np.eye(4)
        T[:3, 3] = first.placement[:3, 3]
        chain = replace(robot.chain, joints=robot.chain.joints[: robot.external_axes], T_last_tip=T)
        expected = replace(robot, chain=chain).forward(q[:, : robot.external_axes])[:, :3, 3]
        np.testing.assert_allclose(robot.foot(q), expected, atol=1e-12)


def test_the_compensator_takes_growth_out_with_no_force_and_within_its_limit():
    model = compensated.arm("on a rail")
    robot = model.model.robot
    state = replace(state_of(touched(grown(arm(), np.full(6, 20e-6)))), share=0.3e-3)
    settings = CompensatorSettings(deadband="0 mm", filter={})
    compensator = Compensator(design(model, settings, state=state))
    q = [0.2] * len(robot.joint_names)
    step, found = compensator.start(), None
    for number in range(2000):
        reading = Reading(0.004 * (number + 1), q, [0.0] * 3, [0.0] * 3)
        step, found = compensator.step(step, reading)
    shift = state.shift(robot, q)
    assert np.linalg.norm(shift) < settings.limits.correction
    np.testing.assert_allclose(found.correction, -shift, atol=1e-12)
    np.testing.assert_allclose(found.deflection, 0.0, atol=1e-12)
    far = replace(state, share=0.99e-3, offset=(1.5e-3, 0.0, 0.0))
    compensator = Compensator(design(model, settings, state=far))
    step = compensator.start()
    for number in range(4000):
        reading = Reading(0.004 * (number + 1), q, [0.0] * 3, [0.0] * 3)
        step, found = compensator.step(step, reading)
    assert np.linalg.norm(far.shift(robot, q)) > settings.limits.correction
    assert np.linalg.norm(found.correction) <= settings.limits.correction * (1 + 1e-12)


def in_two_sessions(first: np.ndarray, second: np.ndarray, at: int, seed: int = 0) -> Touches:
    """Return touches whose arm has these shares before a run was gone on with, and after it."""
    before, after = (touched(grown(arm(), shares), seed=seed) for shares in (first, second))
    late = np.arange(len(before.pose)) >= at
    shift = np.where(late[:, None], after.shift, before.shift)
    sessions = np.stack([np.zeros(len(late), int), late.astype(int)], axis=1)
    return replace(before, shift=shift, by_contact=-shift[:, 0], sessions=sessions)


@pytest.mark.parametrize("at", [3, 6, 10])
def test_touches_of_two_warmths_make_no_state(at):
    """A warm run is stopped, and gone on with when the arm has cooled."""
    warm, cold = np.full(6, 40e-6), np.zeros(6)
    with pytest.raises(CompensationError, match=r"differ by 0\.\d+ mm: the arm was not equally"):
        state_of(in_two_sessions(warm, cold, at))


@pytest.mark.slow
def test_a_run_that_was_gone_on_with_at_once_is_one_state():
    same, refused = np.random.default_rng(1).uniform(10e-6, 30e-6, 6), 0
    for seed in range(60):
        try:
            state_of(in_two_sessions(same, same, 1 + seed % 11, seed))
        except CompensationError:
            refused += 1
    assert refused <= 2


def test_a_run_that_paused_for_long_is_one_state_and_says_so():
    same = np.full(6, 20e-6)
    paused = replace(in_two_sessions(same, same, 5), pause=5400.0)
    assert any("paused for 90 min" in str(each) for each in state_of(paused).findings)
