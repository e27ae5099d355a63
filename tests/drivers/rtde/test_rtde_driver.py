"""What the driver refuses and says, without a line."""

import sys
import time
from types import SimpleNamespace

import numpy as np
import pytest

from elastocal.cell import LOOPBACK, Arming, Motion, RigContext, WallClock, load_cell
from elastocal.cell.examples import write_example
from elastocal.drivers.rtde import DRIVER, driver
from elastocal.drivers.rtde.driver import RtdeDriver, RtdeSettings
from elastocal.drivers.rtde.line import UrLine, pose_of_T
from elastocal.errors import DeviceError
from support.simulated import example_cell
from support.waiting import until


class Controller:
    """A controller that stands at HOME and says what it is told to."""

    def __init__(self, cell, shift=0.0, robot_mode=7, safety_mode=1):
        T = cell.robot.forward(cell.home)
        T[2, 3] += shift
        self.q, self.pose = cell.home.tolist(), pose_of_T(T)
        self.modes = robot_mode, safety_mode
        self.ended = self.deaf = False
        self.said, self.force, self.stamp = [], 0.0, time.monotonic()

    def __getattr__(self, name):
        if not self.deaf:
            self.stamp = time.monotonic()
        values = {
            "isConnected": True,
            "getTimestamp": self.stamp,
            "getActualQ": self.q,
            "getActualTCPPose": self.pose,
            "getActualTCPForce": [0.0, 0.0, self.force, 0.0, 0.0, 0.0],
            "getFtRawWrench": [1.0, 2.0, 250.0, 0.0, 0.0, 0.0],
            "getRobotMode": self.modes[0],
            "getSafetyMode": self.modes[1],
            "isProgramRunning": True,
            "getAsyncOperationProgressEx": SimpleNamespace(isAsyncOperationRunning=lambda: False),
        }

        def call(*given):
            self.ended = self.ended or name == "stopScript"
            if name not in values:
                self.said.append(name)
            return values.get(name, True)

        return call


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    return load_cell(write_example(tmp_path_factory.mktemp("ur20"), "ur20")[0])


def connect(cell, controller, *kinds, **settings):
    driver = RtdeDriver(lambda *_: controller, lambda *_: controller)
    wanted = {kind: RtdeSettings(**settings) for kind in kinds}
    return driver.connect(cell, wanted, RigContext(WallClock(), 0, 0.0, None))


def test_it_is_found_moves_something_and_listens_to_this_machine_alone():
    assert DRIVER.real
    assert DRIVER.kinds == {"arm", "sensor"}
    assert RtdeSettings().address == LOOPBACK


def test_without_the_package_the_extra_is_named(monkeypatch, cell):
    for name in ("rtde_receive", "rtde_control"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(DeviceError, match=r"needs the package ur-rtde: .*elastocal\[ur\]"):
        DRIVER.connect(cell, {"sensor": RtdeSettings()}, RigContext(WallClock(), 0, 0.0, None))


@pytest.mark.parametrize(
    ("modes", "said"),
    [
        ({"safety_mode": 3}, "protective stop"),
        ({"safety_mode": 7}, "robot emergency stop"),
        ({"robot_mode": 5}, "robot mode 5, not running"),
    ],
)
def test_a_controller_that_is_stopped_says_why_and_is_not_enabled(cell, modes, said):
    devices = connect(cell, Controller(cell, **modes), "arm")
    try:
        assert devices.arm.state().fault == said
        with pytest.raises(DeviceError, match="the arm is not armed: nothing moves"):
            devices.arm.enable()
        devices.arm.arming = Arming.of(cell)
        with pytest.raises(DeviceError, match=f"cannot be enabled: {said}"):
            devices.arm.enable()
    finally:
        devices.close()


def test_another_tool_or_arm_is_found_at_the_start_and_its_program_ended(cell):
    controller = Controller(cell, shift=0.15)
    with pytest.raises(DeviceError, match=r"tcp is 150\.0 mm from the model's"):
        connect(cell, controller, "arm")
    assert controller.ended


def test_an_arm_on_a_rail_is_refused(cell):
    with pytest.raises(DeviceError, match="knows six joints"):
        connect(example_cell("afp"), Controller(cell), "arm")


def test_beyond_its_range_the_sensor_is_saturated(cell):
    devices = connect(cell, Controller(cell), "sensor")
    try:
        time.sleep(0.05)
        block = devices.sensor.read()
        assert block.status.value == "saturated"
        assert devices.feed.newest().force[2] == 250.0
    finally:
        devices.close()


def test_a_line_whose_time_stands_is_lost(cell):
    controller = Controller(cell)
    controller.getTimestamp = lambda: 5.0
    line = UrLine(controller, WallClock(), 500.0)
    line.start()
    time.sleep(1.2)
    with pytest.raises(DeviceError, match="has said nothing for"):
        line.sample()
    line.close()


def test_a_line_that_breaks_says_why(cell):
    controller = Controller(cell)
    line = UrLine(controller, WallClock(), 500.0)
    line.start()
    controller.getTimestamp = lambda: 5.0
    time.sleep(0.1)
    with pytest.raises(DeviceError, match=r"the controller is lost: .*rtde"):
        line.sample()
    line.close()


@pytest.fixture
def pressing(cell):
    """Return a controller and its arm, which holds a force in force mode."""
    controller = Controller(cell)
    devices = connect(cell, controller, "arm")
    arm = devices.arm
    arm.arming = Arming.of(cell)
    arm.enable()
    arm.approach(np.array([0.0, 0.0, -1.0]), 0.05, 0.005, 15.0)
    time.sleep(0.1)
    controller.force = 15.0
    until(lambda: arm.state().motion is Motion.IDLE)
    arm.hold(np.array([0.0, 0.0, -50.0]), 500.0)
    controller.said.clear()
    until(lambda: "forceMode" in controller.said)
    yield controller, arm
    devices.close()


def test_an_arm_that_is_not_heard_any_more_is_told_to_stop_before_anybody_closes_it(pressing):
    controller, arm = pressing
    controller.deaf = True
    until(lambda: "stopJ" in controller.said)
    assert controller.said.index("forceModeStop") < controller.said.index("stopJ")
    said = len(controller.said)
    arm.stop()
    time.sleep(0.1)
    assert "forceMode" not in controller.said[said:]


def test_a_refusal_of_the_controller_ends_the_force_at_once(pressing):
    controller, arm = pressing
    controller.forceMode = lambda *_: False
    arm.hold(np.array([0.0, 0.0, -60.0]), 500.0)
    until(lambda: arm.state().fault is not None)
    until(lambda: "stopJ" in controller.said)
    assert arm.state().motion is Motion.STOPPED


def test_a_protective_stop_ends_the_press_for_good(pressing):
    controller, arm = pressing
    controller.modes = 7, 3
    until(lambda: arm.state().fault == "protective stop")
    controller.modes = 7, 1
    until(lambda: "stopJ" in controller.said)
    said = len(controller.said)
    time.sleep(0.1)
    assert "forceMode" not in controller.said[said:]
    assert arm.state().motion is Motion.STOPPED


def test_what_was_felt_before_the_new_zero_is_no_contact(cell):
    """A loaded machine hears of the zero late: the newest sample may be of before it."""
    controller = Controller(cell)

    def zero():
        controller.force = 40.0
        time.sleep(0.2)
        controller.deaf = True
        time.sleep(0.05)
        controller.force = 0.0

    controller.zeroFtSensor = zero
    devices = connect(cell, controller, "arm")
    try:
        devices.arm.arming = Arming.of(cell)
        devices.arm.enable()
        devices.arm.approach(np.array([0.0, 0.0, -1.0]), 0.05, 0.005, 15.0)
        until(lambda: "forceMode" in controller.said)
        time.sleep(0.2)
        controller.deaf = False
        time.sleep(0.1)
        assert devices.arm.state().motion is Motion.APPROACHING
    finally:
        devices.close()


def drop(controller):
    controller.force = 1.3 * 1000.0


def slide(controller):
    controller.pose = [*controller.pose[:2], controller.pose[2] - 0.02, *controller.pose[3:]]


def garble(controller):
    controller.q = [float("nan"), *controller.q[1:]]


def fault(controller):
    controller.modes = 7, 3


@pytest.mark.parametrize("wrong", [drop, slide, garble, fault])
def test_a_press_that_goes_wrong_ends_though_nobody_looks(pressing, wrong):
    """Whoever supervises it may hang."""
    controller, arm = pressing
    wrong(controller)
    until(lambda: "stopJ" in controller.said)
    assert controller.said.index("forceModeStop") < controller.said.index("stopJ")
    said = len(controller.said)
    time.sleep(0.1)
    assert "forceMode" not in controller.said[said:]
    if wrong is not garble:
        reasons = {
            drop: "force limit exceeded: 1300 N",
            slide: "the tool went 20.0 mm from where it touched, limit",
            fault: "protective stop",
        }
        assert reasons[wrong] in arm.state().fault


def test_a_press_that_nobody_looks_at_any_more_ends(pressing, monkeypatch):
    controller, arm = pressing
    monkeypatch.setattr(driver, "UNWATCHED", 0.3)
    for _ in range(10):
        assert arm.state().motion is Motion.HOLDING
        time.sleep(0.05)
    until(lambda: "stopJ" in controller.said)
    assert "nobody has asked how the arm stands" in arm.state().fault


@pytest.mark.parametrize("name", ["forceModeStop", "stopJ"])
def test_a_stop_that_is_not_taken_is_given_again_without_a_sign_of_life(pressing, name):
    controller, arm = pressing
    refused = []

    def refuse(*_):
        refused.append(name)
        raise RuntimeError("one bad cycle")

    setattr(controller, name, refuse)
    arm.stop()
    until(lambda: refused)
    controller.said.clear()
    until(lambda: len(refused) > 3)
    assert "kickWatchdog" not in controller.said
    delattr(controller, name)
    until(lambda: {"forceModeStop", "stopJ"} <= {*controller.said} or name == "stopJ")
    until(lambda: "stopJ" in controller.said)
    assert arm.state().fault == "one bad cycle"


def test_a_retract_that_follows_a_stop_at_once_is_made(pressing):
    controller, arm = pressing
    for _ in range(20):
        arm.stop()
        arm.enable()
        controller.said.clear()
        arm.retract(np.array([0.0, 0.0, 1.0]), 0.05, 0.05)
        until(lambda: "moveL" in controller.said)


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (lambda arm, down: arm.approach(down, 0.05, 0.005, float("nan")), "contact force"),
        (lambda arm, down: arm.approach(down, 0.05, float("nan"), 15.0), "approach speed"),
        (lambda arm, down: arm.approach(down, -0.05, 0.005, 15.0), "approach distance"),
        (lambda arm, down: arm.retract(-down, float("inf"), 0.05), "retract distance"),
        (lambda arm, down: arm.hold(1e4 * down, 50.0), "the force limit"),
        (lambda arm, _: arm.release(float("nan")), "force rate"),
        (lambda arm, _: arm.move_joints(np.full(6, 9.0), 0.5), "joint target"),
        (lambda arm, _: arm.move_joints(np.full(6, np.nan), 0.5), "joint target"),
    ],
)
def test_numbers_that_no_move_may_have_are_refused(cell, command, said):
    devices = connect(cell, Controller(cell), "arm")
    try:
        devices.arm.arming = Arming.of(cell)
        devices.arm.enable()
        with pytest.raises(DeviceError, match=said):
            command(devices.arm, np.array([0.0, 0.0, -1.0]))
        assert devices.arm.state().motion is Motion.IDLE
    finally:
        devices.close()


def test_no_retract_leads_into_the_surface(pressing):
    _, arm = pressing
    with pytest.raises(DeviceError, match="leads into the surface"):
        arm.retract(np.array([0.0, 0.0, -1.0]), 0.05, 0.05)
