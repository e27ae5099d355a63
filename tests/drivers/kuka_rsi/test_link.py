"""The link: who is answered, what is counted, and a thread that ends."""

import socket

import pytest

from elastocal.cell import WallClock
from elastocal.drivers.kuka_rsi.link import LinkAddress, RsiLink
from elastocal.drivers.kuka_rsi.messages import Arrival, IpocWatch, Order, SenMessage
from elastocal.errors import DeviceError
from support.cli import PATIENCE

ROBOT = "127.0.0.1"
CONTROLLER = (ROBOT, 50_000)


class Echo:
    """Notes what it hears, and answers."""

    def __init__(self) -> None:
        self.heard: list[tuple[int, Arrival]] = []
        self.fails: Exception | None = None

    def step(self, message, arrival, _now):
        self.heard.append((message.ipoc, arrival))
        if self.fails is not None:
            raise self.fails
        return SenMessage(order=Order.GUIDE)


class Ticks:
    """A timer that goes on by a step each time that it is asked."""

    def __init__(self, step: float) -> None:
        self.step, self.time = step, 0.0

    def __call__(self) -> float:
        self.time += self.step
        return self.time


def rob(ipoc: int, delay: int = 0) -> bytes:
    return f'<Rob Type="KUKA"><Delay D="{delay}"/><IPOC>{ipoc}</IPOC></Rob>'.encode()


def make(answers: bool = True, step: float = 1e-4, cycle: float = 0.004) -> tuple[RsiLink, Echo]:
    echo = Echo()
    place = LinkAddress(ROBOT, 0, ROBOT, cycle, answers)
    return RsiLink(place, echo, WallClock(), timer=Ticks(step)), echo


def test_messages_are_counted_by_how_they_follow():
    link, echo = make()
    order = [1000, 1004, 1016, 1012, 1020, 900_000, 900_004]
    answers = [link.answer(rob(ipoc), CONTROLLER) for ipoc in order]
    assert [arrival for _, arrival in echo.heard] == [
        Arrival.FIRST,
        Arrival.NEXT,
        Arrival.AFTER_LOSS,
        Arrival.NEXT,
        Arrival.JUMPED,
        Arrival.NEXT,
    ]
    assert answers[3] is None
    assert b"<IPOC>900004</IPOC>" in answers[-1]
    counts = link.statistics()
    assert (counts.lost, counts.out_of_order, counts.jumps) == (2, 1, 1)
    assert (counts.received, counts.answered) == (7, 6)
    assert "2 lost, 0 skipped, 0 late, 1 out of order, 1 IPOC jumps" in counts.sentence()


def test_a_restart_that_counts_from_the_beginning_is_a_jump():
    watch = IpocWatch(0.004)
    assert [watch.classify(ipoc) for ipoc in (5_000_000, 40)] == [Arrival.FIRST, Arrival.JUMPED]


def test_ipoc_begins_again_at_zero_after_32_bits():
    watch = IpocWatch(0.004)
    found = [watch.classify(ipoc) for ipoc in (2**32 - 4, 0, 8, 4)]
    assert found == [Arrival.FIRST, Arrival.NEXT, Arrival.AFTER_LOSS, Arrival.OUT_OF_ORDER]
    assert watch.lost == 1


def test_a_count_that_goes_on_a_little_lower_is_a_program_that_was_started_anew():
    watch = IpocWatch(0.004)
    order = (5000, 5004, 4604, 4608, 4612, 4616)
    assert [watch.classify(ipoc) for ipoc in order][2:] == [
        Arrival.OUT_OF_ORDER, Arrival.OUT_OF_ORDER, Arrival.JUMPED, Arrival.NEXT
    ]  # fmt: skip


def test_old_messages_that_do_not_follow_one_another_stay_old():
    watch = IpocWatch(0.004)
    order = (5000, 5004, 4900, 5008, 4904, 5012, 4908, 4600, 4700)
    found = [watch.classify(ipoc) for ipoc in order]
    assert [each is Arrival.OUT_OF_ORDER for each in found] == [
        False, False, True, False, True, False, True, True, True
    ]  # fmt: skip


def test_simulators_that_count_messages_by_one_are_followed():
    watch = IpocWatch(0.004)
    found = [watch.classify(ipoc) for ipoc in (7, 8, 9, 11, 10)]
    assert found[1:] == [Arrival.NEXT, Arrival.NEXT, Arrival.AFTER_LOSS, Arrival.OUT_OF_ORDER]
    assert watch.lost == 1


def test_an_ipoc_between_the_cycles_is_a_jump():
    watch = IpocWatch(0.012)
    assert [watch.classify(ipoc) for ipoc in (0, 12, 18)][2] is Arrival.JUMPED


def test_nobody_but_the_controller_is_read_or_answered():
    link, echo = make()
    assert link.answer(rob(4), ("127.0.0.2", 50_000)) is None
    assert not echo.heard
    assert link.statistics().foreign == 1


def test_a_second_robot_at_the_same_address_is_not_heard_until_the_first_is_silent():
    link, _ = make(step=0.001)
    second = (ROBOT, 50_001)
    link.answer(rob(4), CONTROLLER)
    assert link.answer(rob(8), second) is None
    assert link.answer(rob(8), CONTROLLER) is not None
    assert link.statistics().foreign == 1
    link._timer.time += 0.6
    assert link.answer(rob(4), second) is not None
    assert link.statistics().jumps == 1


def test_the_short_first_message_of_rsi_2_is_dropped_and_only_the_first():
    link, _ = make()
    assert link.answer(b"<Rob></Rob>", CONTROLLER) is None
    assert link.answer(b"<Rob></Rob>", CONTROLLER) is None
    counts = link.statistics()
    assert (counts.overtures, counts.malformed) == (1, 1)


def test_what_is_malformed_is_counted_and_not_answered():
    link, echo = make()
    link.answer(rob(4), CONTROLLER)
    assert link.answer(b"<Rob", CONTROLLER) is None
    assert len(echo.heard) == 1
    assert link.statistics().malformed == 1


def test_a_refused_telegram_is_explained_once_where_the_reason_stays_the_same():
    link, _ = make()
    for x in ("1620,9999", "1621,0000"):
        link.answer(f'<Rob><RIst X="{x}"/><IPOC>4</IPOC></Rob>'.encode(), CONTROLLER)
    counts = link.statistics()
    assert counts.refused == "RIst.X is '1620,9999', no number: decimal comma"
    assert "2 malformed (RIst.X is '1620,9999'" in counts.sentence()
    assert "refused: RIst.X is '1620,9999'" in counts.counts(0, "arm").sentence()
    link.answer(b"<Rob><IPOC></IPOC></Rob>", CONTROLLER)
    assert link.statistics().last_refused == "IPOC is '', must be a whole number"
    assert link.statistics().refused.startswith("first RIst.X is '1620,9999'")


def test_late_answers_and_the_controllers_own_count_are_kept():
    link, _ = make(step=0.0036)
    for number, ipoc in enumerate((4, 8, 12)):
        link.answer(rob(ipoc, delay=number), CONTROLLER)
    counts = link.statistics()
    assert (counts.late, counts.controller_delay) == (3, 2)
    assert counts.answer_longest == pytest.approx(0.0036)
    quick, _ = make(step=0.0034)
    quick.answer(rob(4), CONTROLLER)
    assert quick.statistics().late == 0


def test_who_only_measures_never_answers():
    link, echo = make(answers=False)
    assert link.answer(rob(4), CONTROLLER) is None
    assert echo.heard
    assert link.statistics().answered == 0


def test_over_loopback_the_answer_goes_to_where_the_datagram_came_from():
    link, _ = make()
    link.start()
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as robot:
            robot.bind((ROBOT, 0))
            robot.settimeout(PATIENCE)
            for ipoc in (4, 8):
                robot.sendto(rob(ipoc), (ROBOT, link.port))
                answer, sender = robot.recvfrom(4096)
                assert f"<IPOC>{ipoc}</IPOC>".encode() in answer
                assert sender == (ROBOT, link.port)
            assert link.wait(0.0)
    finally:
        link.close()


def test_a_port_that_is_taken_is_refused_with_its_address():
    link, _ = make()
    link.start()
    try:
        other = RsiLink(LinkAddress(ROBOT, link.port, ROBOT, 0.004), Echo(), WallClock())
        with pytest.raises(DeviceError, match=f"cannot listen at 127.0.0.1:{link.port}"):
            other.start()
    finally:
        link.close()


@pytest.mark.parametrize("planted", [DeviceError("planted"), ZeroDivisionError("planted")])
def test_what_a_handler_raises_is_kept_and_does_not_end_the_thread(planted):
    link, echo = make()
    echo.fails = planted
    link.require()
    link.start()
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as robot:
            robot.settimeout(0.2)
            robot.sendto(rob(4), (ROBOT, link.port))
            with pytest.raises(TimeoutError):
                robot.recv(4096)
            robot.settimeout(PATIENCE)
            echo.fails = None
            robot.sendto(rob(8), (ROBOT, link.port))
            assert b"<IPOC>8</IPOC>" in robot.recv(4096)
        with pytest.raises(DeviceError, match=r"kuka_rsi: no answer is given: .*planted"):
            link.require()
    finally:
        link.close()


def test_the_counts_of_a_run_are_those_of_the_link():
    link, _ = make()
    for ipoc in (1000, 1004, 1016, 900_000):
        link.answer(rob(ipoc), CONTROLLER)
    counts = link.statistics().counts(3, link.source)
    assert (counts.received, counts.lost, counts.jumps, counts.saturated) == (4, 2, 1, 3)
    assert counts.device == f"kuka_rsi {ROBOT}"
    assert counts.answer is not None
