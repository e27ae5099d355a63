"""Primary and secondary port of the simulated controller, read by the public layout."""

import socket
import struct

import pytest

from elastocal.cell import WallClock, load_cell
from elastocal.cell.examples import write_example
from elastocal.sim.wire import LiveCell
from elastocal.sim.wire.rtde import PORTS, RtdeServer

STATE, MESSAGE = 16, 20
TEXT, VERSION, EXCEPTION = 0, 3, 10
RATE = 5.0
"""Seconds of the cell a second of the wall."""
SIZES = {0: 47, 1: 251, 2: 37, 3: 75, 4: 101}
"""Bytes of the sub-packages, as public clients of PolyScope 5 expect them."""


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ur20")
    write_example(folder, "ur20")
    live = LiveCell(load_cell(folder / "cell.yaml"), 0, WallClock(rate=RATE))
    server = RtdeServer(live, dict.fromkeys(PORTS, 0))
    server.start()
    yield server
    server.close()


class Client:
    """Cuts the stream into packages."""

    def __init__(self, server, name):
        self.line = socket.create_connection(("127.0.0.1", server.ports[name]), 60.0)

    def receive(self):
        size, kind = struct.unpack(">iB", self._exactly(5))
        return kind, self._exactly(size - 5)

    def state(self):
        while True:
            kind, payload = self.receive()
            if kind == STATE:
                return parts(payload)

    def message(self):
        while True:
            kind, payload = self.receive()
            if kind == MESSAGE:
                return payload[9], payload[10:]

    def say(self, script):
        self.line.sendall(script.encode())

    def _exactly(self, count):
        data = b""
        while len(data) < count:
            more = self.line.recv(count - len(data))
            assert more, "the controller closed the line"
            data += more
        return data


def parts(payload):
    found = {}
    while payload:
        size, kind = struct.unpack(">iB", payload[:5])
        found[kind], payload = payload[5:size], payload[size:]
    return found


def joints_of(state):
    return struct.unpack(">" + "3d4fB" * 6, state[1])[::8]


@pytest.fixture(params=["primary", "secondary"])
def client(server, request):
    client = Client(server, request.param)
    yield client
    client.line.close()


def test_the_version_is_the_first_that_comes(client, server):
    kind, payload = client.receive()
    assert (kind, payload[9]) == (MESSAGE, VERSION)
    name = payload[11 : 11 + payload[10]]
    assert name == b"URControl"
    numbers = struct.unpack(">BBii", payload[11 + len(name) :][:10])
    assert numbers == server.robot.version


def test_the_state_has_the_sub_packages_in_their_sizes(client, server):
    state = client.state()
    assert {kind: len(part) + 5 for kind, part in state.items()} == SIZES
    values = server.robot.outputs()
    joints = struct.unpack(">" + "3d4fB" * 6, state[1])
    assert joints[::8] == pytest.approx(values["actual_q"])
    assert set(joints[7::8]) == {253}
    pose = struct.unpack(">12d", state[4])
    assert pose[:6] == pytest.approx(values["actual_TCP_pose"])
    assert pose[6:] == pytest.approx(values["tcp_offset"])
    _, *flags, mode, control = struct.unpack(">Q7?BB", state[0][:17])
    assert (flags[:5], mode, control) == ([True, True, True, False, False], 7, 0)
    board = struct.unpack(">iiBBddbbdd4fB??IB?B", state[3])
    assert board[14] == values["safety_mode"]


def test_states_are_a_tenth_of_a_second_apart(client):
    stamps = [struct.unpack(">Q", client.state()[0][:8])[0] for _ in range(6)]
    assert stamps == sorted(set(stamps))
    # Half a second of the cell each; a loaded machine is later, never earlier.
    assert 1e-6 * (stamps[-1] - stamps[0]) > 4 * 0.1 * RATE


@pytest.mark.slow
def test_a_line_moves_the_joints_and_the_program_runs_until_they_are_there(client):
    q = joints_of(client.state())
    wanted = [q[0] + (0.1 if q[0] < 0.05 else -0.1), *q[1:]]
    client.say(f"movej({[*wanted]}, a=1.0, v=0.02)\n")
    ran = False
    for _ in range(600):
        state = client.state()
        running = struct.unpack(">Q7?", state[0][:15])[6]
        if ran and not running:
            break
        ran = ran or running
    assert ran
    assert joints_of(state) == pytest.approx(wanted, abs=1e-6)


@pytest.mark.parametrize(
    ("script", "reason"),
    [
        (
            "movel(p[0, 0, 0, 0, 0, 0], a=1, v=1)\n",
            b"movel is not simulated: must be one of",
        ),
        ("movej(p[0, 0, 0, 0, 0, 0])\n", b"must be a list of six joints"),
        ("movej([0, 0], v=1)\n", b"must be a list of six joints"),
        ("movej([0, 0, 0, 0, 0, 0], v=0)\n", b"v above 0"),
        ("movej([a, b, c, d, e, f])\n", b"must be a list of six joints"),
        ("movej([99, 0, 0, 0, 0, 0])\n", b"99"),
        ("nonsense\n", b"nonsense is not simulated"),
        ("set_tcp(p[0,0,0,0,0,0])\nhalt\n", b"halt is not simulated"),
    ],
)
def test_a_line_that_is_not_simulated_is_refused_by_a_message(client, script, reason):
    assert client.message()[0] == VERSION
    client.say(script)
    kind, payload = client.message()
    assert kind == EXCEPTION
    assert struct.unpack(">ii", payload[:8]) == (1, 1)
    assert reason in payload[8:]


def test_settings_are_taken_and_texts_are_shown(client):
    assert client.message()[0] == VERSION
    client.say('set_payload(1.2, (0, 0, 0.1))\ntextmsg("hello")\n')
    assert client.message() == (TEXT, b"hello")


def test_a_program_is_taken_by_its_name(client, server):
    client.state()
    client.say("def own_program():\n  sync()\nend\n")
    for _ in range(100):
        client.state()
        if server.robot.program == "own_program":
            break
    assert server.robot.program == "own_program"
    client.say("stopj(2.0)\n")
    for _ in range(100):
        client.state()
        if not server.robot.program:
            break
    assert server.robot.program == ""
