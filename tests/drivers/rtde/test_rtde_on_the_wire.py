"""The driver against the simulated controller, over sockets of this machine."""

import time

import numpy as np
import pytest

from elastocal.cell import Arming, Motion, RigContext, WallClock, load_cell
from elastocal.cell.examples import write_example
from elastocal.drivers.rtde.driver import RtdeDriver, RtdeSettings
from elastocal.errors import DeviceError
from elastocal.sim.wire import LiveCell
from elastocal.sim.wire.rtde import PORTS, RtdeServer
from support.cli import PATIENCE
from support.ur_client import UrClient
from support.waiting import until

RATE = 4.0
"""Seconds of the cell a second of the wall."""
PRESS = np.array([10.0, 0.0, -60.0])
ABOVE = (0.95, 0.05, 0.40)
"""Where the tool looks down on the block, in m."""


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    return load_cell(write_example(tmp_path_factory.mktemp("ur20"), "ur20")[0])


@pytest.fixture
def rig(cell):
    """Return the live cell, its server and the devices of the driver."""
    clock = WallClock(rate=RATE)
    live = LiveCell(cell, 3, clock)
    server = RtdeServer(live, dict.fromkeys(PORTS, 0))
    server.start()
    client = UrClient(server)

    def control(*_):
        client.reuploadScript()
        return client

    driver = RtdeDriver(lambda *_: client, control)
    wanted = {"arm": RtdeSettings(), "sensor": RtdeSettings()}
    found = driver.connect(cell, wanted, RigContext(clock, 0, 0.0, None))
    found.arm.arming = Arming.of(cell)
    yield live, server, found
    found.close()
    server.close()


def wait(arm, *motions, patience=PATIENCE):
    """Wait until the arm is so, in s of the wall; return its state."""
    end = time.monotonic() + patience
    while (state := arm.state()).motion not in motions:
        assert time.monotonic() < end, state
        time.sleep(0.01)
    return state


def above(cell):
    """Return joints with the tool over the block, pointing down."""
    from elastocal.robot.inverse import inverse_for

    T = np.diag([1.0, -1.0, -1.0, 1.0])
    T[:3, 3] = ABOVE
    found = inverse_for(cell.robot).solve(T)
    return found[np.abs(found - cell.home).max(axis=1).argmin()]


def test_a_press_of_the_procedure_by_force_mode(cell, rig):
    _, server, devices = rig
    arm, down, up = devices.arm, np.array([0.0, 0.0, -1.0]), np.array([0.0, 0.0, 1.0])
    assert arm.state().motion is Motion.DISARMED
    arm.enable()
    q = above(cell)
    arm.move_joints(q, 1.0)
    assert arm.state().motion is Motion.MOVING
    state = wait(arm, Motion.IDLE)
    np.testing.assert_allclose(state.q, q, atol=1e-6)
    unloaded = devices.feed.newest().force
    arm.approach(down, 0.095, 0.05, 15.0)
    state = wait(arm, Motion.IDLE)
    assert not state.in_contact
    assert state.T_base_tcp[2, 3] == pytest.approx(ABOVE[2] - 0.095, abs=1e-5)
    arm.approach(down, 0.02, 0.005, 15.0)
    state = wait(arm, Motion.IDLE)
    assert state.in_contact
    assert state.T_base_tcp[2, 3] == pytest.approx(0.3, abs=5e-3)
    arm.hold(PRESS, 50.0)
    # The sensor is at the flange, whose axes are the tcp's.
    until(lambda: np.abs(devices.feed.newest().force - unloaded - PRESS).max() < 8.0)
    assert arm.state().motion is Motion.HOLDING
    arm.release(200.0)
    assert wait(arm, Motion.IDLE).in_contact
    arm.retract(up, 0.05, 0.05)
    state = wait(arm, Motion.IDLE)
    assert not state.in_contact
    assert state.T_base_tcp[2, 3] == pytest.approx(0.35, abs=6e-3)
    assert server.robot.unserved == set()


def test_a_killed_program_does_not_leave_the_arm_pushing(cell, rig):
    live, server, devices = rig
    arm, down = devices.arm, np.array([0.0, 0.0, -1.0])
    arm.enable()
    arm.move_joints(above(cell), 1.0)
    wait(arm, Motion.IDLE)
    arm.approach(down, 0.095, 0.05, 15.0)
    wait(arm, Motion.IDLE)
    arm.approach(down, 0.02, 0.005, 15.0)
    assert wait(arm, Motion.IDLE).in_contact
    arm.hold(PRESS, 200.0)
    until(lambda: live.arm().state().motion is Motion.HOLDING)
    time.sleep(1.5)
    assert server.robot.program
    # As a kill does: nothing is sent any more, not even a stop.
    arm._closed.set()
    arm._thread.join()
    until(lambda: not server.robot.program)
    assert live.arm().state().motion is Motion.STOPPED


def test_a_program_that_somebody_has_ended_is_a_fault(cell, rig):
    live, server, devices = rig
    arm = devices.arm
    arm.enable()
    arm.move_joints(above(cell), 0.05)
    until(lambda: live.arm().state().motion is Motion.MOVING)
    time.sleep(0.5)
    server.robot.unload()
    until(lambda: arm.state().fault is not None)
    assert arm.state().fault == "the program on the controller has ended"
    arm.enable()
    assert server.robot.program
    arm.move_joints(above(cell), 1.0)
    wait(arm, Motion.IDLE)


def test_what_does_not_fit_is_refused_and_a_stop_always_goes(cell, rig):
    _, _, devices = rig
    arm = devices.arm
    with pytest.raises(DeviceError, match="refuses move_joints: it is disarmed"):
        arm.move_joints(cell.home, 0.5)
    arm.enable()
    with pytest.raises(DeviceError, match="allowed only in contact"):
        arm.hold(PRESS, 50.0)
    arm.move_joints(above(cell), 0.3)
    with pytest.raises(DeviceError, match=r"refuses approach: it is moving"):
        arm.approach(np.array([0.0, 0.0, -1.0]), 0.1, 0.02, 15.0)
    arm.stop()
    arm.stop()
    assert arm.state().motion is Motion.STOPPED
    arm.enable()
    still = wait(arm, Motion.IDLE).q
    time.sleep(0.2)
    np.testing.assert_allclose(arm.state().q, still, atol=2e-2)


def test_the_sensor_hands_out_what_the_cells_sensor_measures(rig):
    live, _, devices = rig
    time.sleep(0.2)
    block = devices.sensor.read()
    assert len(block) > 3
    assert np.all(np.diff(block.time) > 0.0)
    np.testing.assert_allclose(block.force.mean(axis=0), live.wrench().force, atol=8.0)


def test_a_controller_that_is_gone_is_said_by_name(rig):
    _, server, devices = rig
    server.close()
    with pytest.raises(DeviceError, match="rtde: the controller has said nothing for"):
        until(lambda: devices.arm.state() is None)
