"""The simulated controller of Universal Robots: its messages, and other people's client."""

import json
import os
import random
import struct
import subprocess
import sys
import textwrap
import time

import pytest

from elastocal.cell import WallClock, load_cell
from elastocal.cell.examples import write_example
from elastocal.errors import DeviceError
from elastocal.sim.wire import LiveCell
from elastocal.sim.wire.rtde import PORTS, RtdeServer
from support.cli import ENTRY, PATIENCE
from support.simulated import example_cell
from support.ur_client import RtdeClient


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ur20")
    write_example(folder, "ur20")
    return folder


@pytest.fixture(scope="module")
def server(folder):
    server = RtdeServer(
        LiveCell(load_cell(folder / "cell.yaml"), 0, WallClock()), dict.fromkeys(PORTS, 0)
    )
    server.start()
    yield server
    server.close()


@pytest.fixture
def client(server):
    client = RtdeClient("127.0.0.1", server.port)
    assert client.ask("V", struct.pack(">H", 2)) == b"\x01"
    yield client
    client.close()


def test_versions_one_and_two_are_spoken_and_no_other(client):
    for version, answer in ((1, b"\x01"), (3, b"\x00"), (2, b"\x01"), (0, b"\x00")):
        assert client.ask("V", struct.pack(">H", version)) == answer
    assert struct.unpack(">4I", client.ask("v"))[0] == 5


def test_a_recipe_with_an_unknown_name_says_which_and_does_not_start(client):
    answer = client.ask("O", struct.pack(">d", 125.0) + b"timestamp,actual_qq,actual_q,")
    assert answer == b"\x00DOUBLE,NOT_FOUND,VECTOR6D"
    assert client.ask("S") == b"\x00"


def test_outputs_come_in_the_order_of_the_recipe_until_paused(client, server):
    names = b"actual_q,robot_mode,timestamp"
    assert client.ask("O", struct.pack(">d", 500.0) + names)[0] == 1
    assert client.ask("S") == b"\x01"
    times = []
    for _ in range(5):
        kind, payload = client.receive()
        assert kind == "U"
        recipe, *q, mode, stamp = struct.unpack(">B6did", payload)
        times.append(stamp)
    assert (recipe, mode) == (1, 7)
    assert q == pytest.approx(server.robot.outputs()["actual_q"])
    assert times == sorted(times)
    assert client.ask("P") == b"\x01"


@pytest.mark.parametrize("asked", [True, False])
def test_version_one_has_no_numbers_of_recipes_and_no_rate(server, asked):
    line = RtdeClient("127.0.0.1", server.port)
    if asked:
        assert line.ask("V", struct.pack(">H", 1)) == b"\x01"
    assert line.ask("O", b"timestamp,no_such_name") == b"DOUBLE,NOT_FOUND"
    assert line.ask("S") == b"\x00"
    assert line.ask("O", b"actual_q,robot_mode") == b"VECTOR6D,INT32"
    assert line.ask("I", b"input_int_register_0") == b"\x01INT32"
    assert line.ask("S") == b"\x01"
    *q, mode = struct.unpack(">6di", line.ask("U"))
    assert mode == 7
    assert q == pytest.approx(server.robot.outputs()["actual_q"])
    assert line.ask("P") == b"\x01"
    line.send("U", b"\x07" + bytes(4))
    assert line.ask("M") == b"\x02a package of no recipe"
    line.close()


def test_an_input_package_of_no_recipe_is_answered_by_a_text(client):
    client.send("U", b"\x07" + bytes(4))
    kind, payload = client.receive()
    assert kind == "M"
    assert b"no recipe" in payload


@pytest.mark.parametrize("seed", range(5))
def test_whatever_comes_the_server_goes_on(server, seed):
    rng = random.Random(seed)
    line = RtdeClient("127.0.0.1", server.port)
    try:
        for _ in range(20):
            line.send(chr(rng.randrange(256)), rng.randbytes(rng.randrange(80)))
        line.socket.sendall(rng.randbytes(2000))
    except OSError:
        pass
    line.close()
    other = RtdeClient("127.0.0.1", server.port)
    assert other.ask("V", struct.pack(">H", 2)) == b"\x01"
    other.close()


def test_an_arm_with_a_rail_has_no_such_controller():
    with pytest.raises(DeviceError, match="RTDE knows six joints"):
        RtdeServer(LiveCell(example_cell("afp"), 0, WallClock()), dict.fromkeys(PORTS, 0))


PRESS = """
    import json, sys, time
    import numpy as np
    from rtde_control import RTDEControlInterface as Control
    from rtde_receive import RTDEReceiveInterface as Receive
    address = sys.argv[1]
    receive = Receive(address, 125.0)
    control = Control(address, 500.0, Control.FLAG_UPLOAD_SCRIPT | Control.FLAG_NO_EXT_FT)
    def arrived():
        while control.getAsyncOperationProgressEx().isAsyncOperationRunning():
            time.sleep(0.02)
    home = receive.getActualQ()
    q = [0.05, -1.9, -1.75, -1.05, 1.5707963267948966, 0.05]
    control.moveJ(q, 1.0, 1.0, True)
    arrived()
    moved = float(np.abs(np.subtract(receive.getActualQ(), q)).max())
    control.zeroFtSensor()
    time.sleep(0.2)
    pose = receive.getActualTCPPose()
    limits = [0.05, 0.05, 0.02, 0.1, 0.1, 0.1]
    # The tool looks down: the z axis of the task frame is the tool's.
    control.forceMode(pose, [0, 0, 1, 0, 0, 0], [0, 0, 15.0, 0, 0, 0], 2, limits)
    for _ in range(600):
        time.sleep(0.05)
        if receive.getActualTCPForce()[2] > 10.0:
            break
    control.forceModeStop()
    pose = receive.getActualTCPPose()
    for _ in range(100):
        control.forceMode(pose, [1, 1, 1, 0, 0, 0], [0, 0, 80.0, 0, 0, 0], 2, limits)
        time.sleep(0.05)
        force = np.array(receive.getActualTCPForce()[:3])
        if abs(np.linalg.norm(force) - 80.0) < 8.0:
            break
    control.forceModeStop()
    control.stopScript()
    print(json.dumps({"moved": moved, "force": force.tolist(), "height": pose[2]}))
"""


@pytest.mark.slow
def test_ur_rtde_moves_and_presses_in_force_mode(folder, tmp_path):
    """`ur-rtde` holds Python's lock while it waits: the controller is another process."""
    pytest.importorskip("rtde_control", reason="the extra ur is not installed")
    address, ports = f"127.77.{os.getpid() % 250 + 1}.9", tmp_path / "ports.json"
    cell = folder / "cell.yaml"
    text = cell.read_text(encoding="utf-8")
    devices = f"devices: {{arm: {{driver: rtde, address: {address}}}}}\n\nsimulation:"
    served = folder / "served.yaml"
    served.write_text(text.replace("simulation:", devices, 1), encoding="utf-8")
    command = [sys.executable, "-c", ENTRY, "simulate", served, "--ports", ports]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as simulator:
        try:
            for _ in range(600):
                if ports.exists():
                    break
                time.sleep(0.1)
            script = textwrap.dedent(PRESS)
            done = subprocess.run(
                [sys.executable, "-c", script, address],
                capture_output=True, text=True, timeout=PATIENCE, check=False,
            )  # fmt: skip
            assert done.returncode == 0, done.stderr
        finally:
            simulator.terminate()
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["moved"] < 1e-6
    assert found["height"] == pytest.approx(0.3, abs=0.01)
    assert sum(v**2 for v in found["force"]) ** 0.5 == pytest.approx(80.0, abs=8.0)
