"""Faults of the simulated controller, and what the driver's end of the line makes of them."""

import numpy as np
import pytest

from elastocal.cell import Arming, Motion, RigContext, WallClock
from elastocal.drivers.kuka_rsi import Bounds, RsiSettings
from elastocal.drivers.kuka_rsi.corrections import PathCorrections
from elastocal.drivers.kuka_rsi.driver import connect_arm
from elastocal.drivers.kuka_rsi.link import LinkAddress, RsiLink
from elastocal.sim.wire import LiveCell, Told
from elastocal.sim.wire.rsi import RsiContext, rsi_server
from support.simulated import QUIET, example_cell, places
from support.waiting import until

BOUNDS = Bounds(
    correction=2e-3, poscorr=5e-3, monitor=6e-3, turn=0.1, speed=0.05, force=1e3, travel=0.01
)
CYCLES = 40


class Nothing:
    def correction(self, _message, _now, _effect):
        return np.zeros(3)


def exchanged(*faults, cycles=CYCLES):
    """Return what both ends have counted after some cycles with faults among them."""
    live = LiveCell(example_cell(simulation=QUIET), 0, WallClock(rate=50.0))
    handler = PathCorrections(Nothing(), BOUNDS, 0.004)
    link = RsiLink(LinkAddress("127.0.0.1", 0, "127.0.0.1", 0.004), handler, WallClock())
    link.start()
    context = RsiContext(patience=0.5)
    server = rsi_server(live, Told(settings={"port": link.port}), context)
    server.inject(*faults, after=5)
    server.start()
    try:
        until(lambda: server.statistics.answered >= cycles)
    finally:
        server.close()
        link.close()
    return link.statistics(), server.statistics


@pytest.mark.parametrize(
    ("fault", "count", "late"),
    [("ipoc_jump", {"jumps": 1}, 0), ("lost", {"lost": 1}, 1), ("repeated", {"old": 1}, 0),
     ("malformed", {"malformed": 1, "lost": 1}, 1), ("restart", {"jumps": 1}, 0), ("deaf", {}, 1),
     ("intruder", {"foreign": 1}, 0)],
)  # fmt: skip
def test_each_fault_is_counted_and_the_line_goes_on(fault, count, late):
    link, server = exchanged(fault)
    found = {key: getattr(link, key) for key in ("jumps", "lost", "malformed", "foreign")}
    # What comes twice is either passed over in favour of the newer one, or found to be old.
    found["old"] = link.out_of_order + link.skipped
    assert found == dict.fromkeys(found, 0) | count
    assert server.late == late


def test_datagrams_in_the_wrong_order_cost_a_cycle_or_two():
    link, server = exchanged("swapped")
    assert link.out_of_order + link.skipped == 1
    assert (link.jumps, link.malformed, link.foreign) == (0, 0, 0)
    assert 1 <= server.late <= 2


@pytest.fixture
def connected():
    """Return an arm that is enabled, and the controller that it is connected to."""
    clock = WallClock(rate=1.0)
    cell = example_cell(simulation=QUIET)
    live = LiveCell(cell, 0, clock)
    server = rsi_server(live, Told(), RsiContext(patience=0.2, operator=0.0))
    server.start()
    settings = RsiSettings(mode="contact", port=server.ports["udp"], delay="12 ms", ptp_percent=30)
    arm = connect_arm(cell, settings, RigContext(clock, 0, 0.0, live))
    until(lambda: live.wrench() is not None)
    arm.arming = Arming.of(cell)
    arm.enable()
    yield arm, server
    arm.link.close()
    server.close()


@pytest.mark.parametrize("fault", ["ipoc_jump", "restart"])
def test_an_arm_stops_where_the_count_jumps(connected, fault):
    arm, server = connected
    server.inject(fault)
    until(lambda: arm.state().motion is Motion.STOPPED)
    assert arm.state().fault == "IPOC has jumped: the controller's program was started anew"


def test_an_arm_says_so_when_the_controller_stops(connected):
    arm, server = connected
    server.close()
    until(lambda: arm.state().motion is Motion.STOPPED)
    assert "nothing from the controller for 0." in arm.state().fault


def test_a_move_goes_on_through_lost_datagrams(connected):
    arm, server = connected
    goal = places()[1].q_approach
    arm.move_joints(goal, 0.3)
    for _ in range(3):
        server.inject("lost", "repeated", "swapped", after=7)
    until(lambda: arm.state().motion is Motion.IDLE)
    assert arm.state().fault is None
    np.testing.assert_allclose(arm.state().q, goal, atol=1e-7)
