"""What the driver refuses and says, without a line."""

import sys
import time
from types import SimpleNamespace

import pytest

from elastocal.cell import LOOPBACK, Arming, RigContext, WallClock, load_cell
from elastocal.cell.examples import write_example
from elastocal.drivers.rtde import DRIVER
from elastocal.drivers.rtde.driver import RtdeDriver, RtdeSettings
from elastocal.drivers.rtde.line import UrLine, pose_of_T
from elastocal.errors import DeviceError
from support.simulated import example_cell


class Controller:
    """A controller that stands at HOME and says what it is told to."""

    def __init__(self, cell, shift=0.0, robot_mode=7, safety_mode=1):
        T = cell.robot.forward(cell.home)
        T[2, 3] += shift
        self.q, self.pose = cell.home.tolist(), pose_of_T(T)
        self.modes = robot_mode, safety_mode
        self.ended = False

    def __getattr__(self, name):
        values = {
            "isConnected": True,
            "getTimestamp": time.monotonic(),
            "getActualQ": self.q,
            "getActualTCPPose": self.pose,
            "getActualTCPForce": [0.0] * 6,
            "getFtRawWrench": [1.0, 2.0, 250.0, 0.0, 0.0, 0.0],
            "getRobotMode": self.modes[0],
            "getSafetyMode": self.modes[1],
            "isProgramRunning": True,
            "getAsyncOperationProgressEx": SimpleNamespace(isAsyncOperationRunning=lambda: False),
        }

        def call(*given):
            self.ended = self.ended or name == "stopScript"
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
