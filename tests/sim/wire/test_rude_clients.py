"""Clients that hang up, send half a message or nonsense leave no traceback, and others go on."""

import contextlib
import random
import socket
import struct
import threading

import pytest

from elastocal.cell import WallClock
from elastocal.errors import DeviceError
from elastocal.sim.wire import LiveCell, Told, suited_servers, wire_servers
from support.simulated import QUIET, example_cell

HALVES = (
    b"",
    b"GET /netftapi2.xml HT",
    b"GET /netftapi2.xml HTTP/1.0\r\n\r\n",
    b"POST / HTTP/9.9\r\nContent-Length: -1\r\n\r\n",
    b"\x00\x03V",
    struct.pack("<ii", 2**31 - 1, -1),
    b"def f():\n",
    b"x[mm],y[mm]\n1,",
)


def places(server):
    """Return the TCP ports of a server, those that can be connected to."""
    found = []
    for port in server.ports.values():
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 1.0):
            found.append(port)
    return found


def be_rude(port, rng):
    """Send something and go, by a reset, half a close, or a plain one."""
    noise = rng.choice([*HALVES, rng.randbytes(rng.randrange(200))])
    with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 1.0) as line:
        line.sendall(noise)
        way = rng.randrange(3)
        if way == 0:
            line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        elif way == 1:
            line.shutdown(socket.SHUT_WR)


@pytest.mark.parametrize("name", sorted(wire_servers()))
def test_rude_clients_leave_no_traceback(name, capfd, monkeypatch):
    fallen = []
    monkeypatch.setattr(threading, "excepthook", lambda each: fallen.append(repr(each.exc_value)))
    cell = example_cell("ur20" if name == "rtde" else "afp", simulation=QUIET)
    assert name in suited_servers(cell.robot)
    live = LiveCell(cell, 3, WallClock(rate=10.0))
    server = wire_servers()[name](live, Told())
    try:
        server.start()
        ports, rng = places(server), random.Random(5)
        for _ in range(60):
            for port in ports:
                be_rude(port, rng)
        for port in ports:
            socket.create_connection(("127.0.0.1", port), 5.0).close()
    finally:
        server.close()
    assert fallen == []
    assert "Traceback" not in capfd.readouterr().err


def test_a_page_that_its_client_resets_leaves_no_traceback(capfd):
    server = wire_servers()["net_ft"](LiveCell(example_cell(), 3, WallClock()), Told())
    handler = server._http
    try:
        raise ConnectionResetError
    except ConnectionResetError:
        handler.handle_error(None, ("127.0.0.1", 1))
    server.close()
    assert capfd.readouterr().err == ""


def test_a_taken_port_is_refused_in_one_line():
    live = LiveCell(example_cell(), 3, WallClock())
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(DeviceError, match=f"^[^\\n]*{port}[^\\n]*$"):
            wire_servers()["line_stream"](live, Told(settings={"port": port}))
