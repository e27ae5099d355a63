"""Bounds of corrections, and how a controller that does not follow them is found."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from elastocal.cell import Arming, PathCycle, RigContext, WallClock
from elastocal.drivers.kuka_rsi import Bounds, RsiSettings
from elastocal.drivers.kuka_rsi.corrections import CorrectedKuka, CorrectionGuard, PathCorrections
from elastocal.drivers.kuka_rsi.messages import Arrival, RobMessage
from elastocal.errors import DeviceError
from elastocal.robot import xyzabc_from_T
from support.simulated import example_cell

CYCLE = 0.004
BOUNDS = Bounds(0.003, 0.005, 0.006, 0.017, 0.05, 1000.0, 0.015)
STEP = np.array([1e-4, 0.0, 0.0])


def drive(guard: CorrectionGuard, cycles: int, clamp: float = np.inf, lost: int = 0, delay=2):
    """Send a step each cycle; the controller clamps, and follows some cycles later."""
    at, late = 0.0, [0.0] * delay
    for k in range(cycles):
        guard.bounded(STEP, np.array([late.pop(0), 0.0, 0.0]))
        at = min(at + (STEP[0] if k >= lost else 0.0), clamp)
        late.append(at)


def fresh(delay: float = 0.008) -> CorrectionGuard:
    guard = CorrectionGuard(BOUNDS, CYCLE, delay)
    guard.restart(np.zeros(3))
    return guard


def test_the_largest_correction_is_the_pcs_below_the_controllers():
    drive(fresh(), 30)
    with pytest.raises(DeviceError, match=r"correction of 3\.10 mm .* largest is 3 mm"):
        drive(fresh(), 31)


def test_a_piece_faster_than_the_limit_is_refused():
    with pytest.raises(DeviceError, match=r"0\.25 mm in one cycle: at most 0\.2 mm"):
        fresh().bounded(np.array([0.0, 0.0, 2.5e-4]), np.zeros(3))


def test_no_speed_is_above_a_millimetre_in_four_milliseconds():
    guard = CorrectionGuard(Bounds(0.1, 0.2, 0.3, 0.0, 9.0, 1e3, 0.015), CYCLE, 0.008)
    guard.restart(np.zeros(3))
    with pytest.raises(DeviceError, match="at most 1 mm"):
        guard.bounded(np.array([1.01e-3, 0.0, 0.0]), np.zeros(3))


def test_a_correction_that_goes_back_is_never_refused():
    guard = fresh()
    guard.restart(np.array([0.004, 0.0, 0.0]))
    guard.bounded(-STEP, np.array([0.004, 0.0, 0.0]))


def test_a_controller_that_clamps_is_found_by_what_it_does():
    guard = fresh()
    with pytest.raises(DeviceError, match=r"saturated.*POSCORR clamps"):
        follow_clamped(guard)


def follow_clamped(guard: CorrectionGuard) -> None:
    drive(guard, 30, clamp=2e-4)
    for _ in range(60):
        guard.bounded(np.zeros(3), np.array([2e-4, 0.0, 0.0]))


def test_a_few_lost_answers_are_made_up_for_and_are_no_saturation():
    guard = fresh()
    drive(guard, 20, lost=3)
    there = np.array([17e-4, 0.0, 0.0])
    for _ in range(60):
        guard.bounded(np.zeros(3), there)
    for _ in range(10):
        guard.bounded(STEP, there)


@dataclass
class Wants:
    wanted: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def correction(self, _message, _now, _effect):
        return self.wanted


def test_corrections_of_a_path_are_absolute_bounded_and_never_jump():
    wants = Wants(np.array([0.0, 0.002, 0.0]))
    handler = PathCorrections(wants, BOUNDS, CYCLE, "PC")
    sent = [handler.step(RobMessage(k), Arrival.NEXT, 0.0).correction for k in range(15)]
    np.testing.assert_allclose([y for _, y, *_ in sent][:11], [*np.arange(0.2, 2.1, 0.2), 2.0])
    assert all(row[3:] == (0.0, 0.0, 0.0) for row in sent)
    wants.wanted = np.array([0.0, 0.0, np.nan])
    assert handler.step(RobMessage(16), Arrival.NEXT, 0.0).correction == sent[-1]
    wants.wanted = np.array([0.0, 0.09, 0.0])
    for k in range(20):
        last = handler.step(RobMessage(20 + k), Arrival.NEXT, 0.0)
    assert last.correction[1] == pytest.approx(3.0)
    assert (handler.clamped, handler.held) == (20, 1)
    assert last.target is None
    assert not last.stop


@dataclass
class Controller:
    """A controller that holds its last absolute correction, and its handler; x alone, in mm.

    It follows a correction some cycles later, and counts answers that it misses.
    """

    handler: PathCorrections
    follows: int = 2
    tells: bool = True
    time: float = 10.0
    held: float = 0.0
    missed: int = 0
    largest: float = 0.0
    """Largest change of what it holds, in one cycle."""

    def __post_init__(self):
        self.late = [0.0] * self.follows
        self.first = Arrival.FIRST

    def cycle(self, arrival=Arrival.NEXT, lost=False, unheard=False):
        """Do a cycle whose answer, or whose message, may be lost; return what was answered."""
        self.time += CYCLE
        self.late.append(self.held)
        seen = (self.late.pop(0), 0.0, 0.0, 0.0, 0.0, 0.0)
        message = RobMessage(0, actual=seen, setpoint=(0.0,) * 6, delay=self.missed)
        if not self.tells:
            message = RobMessage(0)
        arrival, self.first = self.first or arrival, None
        answer = None if unheard else self.handler.step(message, arrival, self.time)
        if lost or answer is None:
            self.missed += 1
        else:
            x, self.missed = answer.correction[0], 0
            self.largest, self.held = max(self.largest, abs(x - self.held)), x
        return answer

    def restart(self):
        self.held, self.missed, self.late = 0.0, 0, [0.0] * self.follows


def controlled(wanted=1e-3, cycles=20, delay=0.008, timeout=10, **facts):
    wants = Wants(np.array([wanted, 0.0, 0.0]))
    handler = PathCorrections(wants, BOUNDS, CYCLE, timeout=timeout, delay=delay)
    far = Controller(handler, **facts)
    for _ in range(cycles):
        far.cycle()
    return far, wants


LIMIT = 0.2 * (1 + 1e-9)
"""Largest step, in mm."""


def test_a_program_that_was_started_anew_begins_without_correction():
    far, _ = controlled()
    assert far.held == pytest.approx(1.0)
    far.restart()
    assert far.cycle(Arrival.JUMPED).correction[0] == pytest.approx(0.2)
    assert far.largest <= LIMIT


def test_a_jump_of_the_count_alone_takes_no_correction_back():
    far, wants = controlled()
    assert far.cycle(Arrival.JUMPED).correction[0] == pytest.approx(1.0)
    wants.wanted = np.array([2e-3, 0.0, 0.0])
    assert [far.cycle().correction[0] for _ in range(3)] == pytest.approx([1.0, 1.2, 1.4])
    assert far.largest <= LIMIT


def test_a_jump_on_the_way_is_not_answered_until_the_arm_shows_what_is_in_effect():
    far, _ = controlled(cycles=3, follows=4, delay=0.016)
    answers = [far.cycle(Arrival.JUMPED)] + [far.cycle() for _ in range(6)]
    assert answers[0] is None
    assert answers[-1] is not None
    assert far.handler.withheld > 0
    assert far.largest <= LIMIT
    for _ in range(10):
        far.cycle()
    assert far.held == pytest.approx(1.0)
    assert far.largest <= LIMIT


@pytest.mark.parametrize("restarts", [False, True])
@pytest.mark.parametrize("lost", [9, 11, 20, 300])
def test_after_a_silence_of_any_length_the_arm_shows_where_the_correction_goes_on(lost, restarts):
    far, _ = controlled(timeout=10)
    for _ in range(lost):
        far.cycle(unheard=True)
    if restarts and lost > 10:
        far.restart()
    far.cycle(Arrival.AFTER_LOSS)
    for _ in range(20):
        far.cycle()
    assert far.largest <= LIMIT
    assert far.held == pytest.approx(1.0)


@pytest.mark.parametrize(("lost", "anew"), [(9, False), (20, True)])
def test_without_rist_and_rsol_a_silence_beyond_timeout_counts_as_a_stop(lost, anew):
    far, _ = controlled(timeout=10, tells=False)
    for _ in range(lost):
        far.cycle(unheard=True)
    again = far.cycle(Arrival.AFTER_LOSS).correction[0]
    assert again == pytest.approx(0.2 if anew else 1.0)


def test_without_rist_and_rsol_a_jump_within_timeout_goes_on():
    far, _ = controlled(tells=False)
    assert far.cycle(Arrival.JUMPED).correction[0] == pytest.approx(1.0)


def test_lost_answers_do_not_add_up():
    far, _ = controlled(cycles=3)
    held = far.held
    answers = [far.cycle(lost=True).correction[0] for _ in range(9)]
    assert answers[1:] == pytest.approx([held] * 8)
    again = [far.cycle().correction[0] for _ in range(4)]
    assert again == pytest.approx([held, held, held + 0.2, held + 0.4])
    assert far.largest <= LIMIT
    assert far.handler.largest_step * 1e3 <= LIMIT


@pytest.mark.parametrize("seed", range(20))
def test_whatever_is_lost_the_controller_never_takes_more_than_a_step(seed):
    rng = np.random.default_rng(seed)
    far, wants = controlled(cycles=1, timeout=100, follows=int(rng.integers(1, 6)), delay=0.024)
    for _ in range(1500):
        if rng.random() < 0.05:
            wants.wanted = rng.uniform(-2e-3, 2e-3) * np.array([1.0, 0.0, 0.0])
        event = rng.choice(["none", "lost", "unheard", "jump", "restart"], p=[
            0.85, 0.07, 0.05, 0.02, 0.01])  # fmt: skip
        for _ in range(int(rng.integers(1, 12)) if event in ("lost", "unheard") else 0):
            far.cycle(lost=event == "lost", unheard=event == "unheard")
        if event == "restart":
            far.restart()
        jumped = event in ("jump", "restart")
        unheard = Arrival.AFTER_LOSS if event == "unheard" else Arrival.NEXT
        far.cycle(Arrival.JUMPED if jumped else unheard)
        assert far.largest <= LIMIT, event


def test_a_correction_that_is_not_of_this_program_is_refused():
    handler = PathCorrections(Wants(), BOUNDS, CYCLE)
    message = RobMessage(0, actual=(0.62, 0.0, 0.0, 0.0, 0.0, 0.0), setpoint=(0.0,) * 6)
    with pytest.raises(DeviceError, match=r"RIst is 0\.62 mm from RSol before the first answer"):
        handler.step(message, Arrival.FIRST, 0.0)
    message = RobMessage(0, actual=(0.01, 0.0, 0.0, 0.0, 0.0, 0.0), setpoint=(0.0,) * 6)
    assert handler.step(message, Arrival.NEXT, 0.0).correction[0] == 0.0


def test_corrections_that_are_over_raise_stop_and_go_back_at_the_same_speed():
    wants = Wants(np.array([4e-4, 0.0, 0.0]))
    handler = PathCorrections(wants, BOUNDS, CYCLE)
    for k in range(5):
        assert not handler.step(RobMessage(k), Arrival.NEXT, 0.0).stop
    wants.wanted = None
    told = [handler.step(RobMessage(5 + k), Arrival.NEXT, 0.0) for k in range(3)]
    assert [each.stop for each in told] == [True] * 3
    assert [each.correction[0] for each in told] == pytest.approx([0.2, 0.0, 0.0])


class Cycles:
    """Notes what it is asked, and wants nothing."""

    def __init__(self) -> None:
        self.seen: list[PathCycle] = []

    def correction(self, cycle):
        self.seen.append(cycle)
        return (1e-4, 0.0, 0.0)


@pytest.fixture
def corrected():
    """An arm whose path is corrected, its source, and what its controller would send."""
    cell = example_cell("afp")
    settings = RsiSettings.model_validate(
        {"mode": "compensation", "port": 0, "largest_correction": "1 mm"}
    )
    source = Cycles()
    unarmed = RigContext(WallClock(), 0, 0.0, None)
    with pytest.raises(DeviceError, match="the arm is not armed: nothing moves"):
        CorrectedKuka(cell, settings, unarmed, source)
    arm = CorrectedKuka(cell, settings, replace(unarmed, arming=Arming.of(cell)), source)
    place = xyzabc_from_T(cell.robot.forward(cell.home))
    yield arm, source, message_at(cell.home, place)
    arm.close()


def message_at(q, place):
    frame = [*(1e3 * place[:3]), *np.degrees(place[3:])]
    axes = np.degrees(q[1:])

    def element(name, keys, values):
        inside = " ".join(f'{k}="{v:.6f}"' for k, v in zip(keys, values, strict=True))
        return f"<{name} {inside}/>"

    def message(ipoc, shift=0.0):
        moved = [frame[0] + shift, *frame[1:]]
        parts = element("RIst", "XYZABC", moved)
        parts += element("AIPos", [f"A{k}" for k in range(1, 7)], axes)
        parts += element("EIPos", [f"E{k}" for k in range(1, 7)], [1e3 * q[0], 0, 0, 0, 0, 0])
        return f'<Rob Type="KUKA">{parts}<IPOC>{ipoc}</IPOC></Rob>'.encode()

    return message


SENDER = ("127.0.0.1", 50_000)


def test_a_kuka_on_its_path_gives_joints_and_takes_what_its_source_wants(corrected):
    arm, source, message = corrected
    answers = [arm._link.answer(message(4 * k), SENDER) for k in range(1, 4)]
    assert all(b'RKorr X="0.100000"' in each for each in answers)
    assert [each.begins for each in source.seen] == [True, False, False]
    np.testing.assert_allclose(source.seen[-1].q, example_cell("afp").home, atol=1e-7)
    counts = arm.statistics()  # how many were late is the matter of this machine
    assert (counts.received, counts.answered) == (3, 3)
    assert counts.answer_p50 is not None


def test_a_program_whose_tool_is_elsewhere_gets_no_answer(corrected):
    arm, source, message = corrected
    assert arm._link.answer(message(4, shift=40.0), SENDER) is None
    with pytest.raises(DeviceError, match=r"RIst is 40\.0 mm .* check \$TOOL, \$BASE"):
        arm.require()
    assert not source.seen
