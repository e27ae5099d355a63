"""Line streams over the loopback: against the simulator, and against a few lines of a site."""

import socket
import threading

import numpy as np
import pytest

from elastocal.cell import BeamState
from elastocal.drivers.line_stream import DRIVER
from elastocal.errors import DeviceError, ElastocalError
from elastocal.sim.wire import LiveCell, Told
from elastocal.sim.wire.line_stream import LineStreamServer
from elastocal.sim.workcell import SimClock
from support.cli import PATIENCE
from support.simulated import QUIET, example_cell
from support.stations_on_wire import connect, read_until

FAR = {"patience": "1000 s", "silence": "1 s"}


def has_points(block):
    return len(block) > 0


def broken(block):
    return block.beam is BeamState.BROKEN


@pytest.fixture
def clock():
    return SimClock(5.0)


@pytest.fixture
def opened():
    """Things to close, the last one first."""
    things = []
    yield things
    for thing in reversed(things):
        thing.close()


def served(clock, opened, told=None, cell=None, **figures):
    cell = cell or example_cell(simulation=QUIET)
    server = LineStreamServer(LiveCell(cell, 3, clock), told or Told(), **figures)
    server.start()
    opened.append(server)
    return server


def connected(clock, opened, port, cell=None, **settings):
    cell = cell or example_cell(simulation=QUIET)
    devices = connect(DRIVER, cell, clock, port=port, **(FAR | settings))
    opened.append(devices)
    return devices


def site(opened):
    """Return the socket of an adapter that is waited for, and its port."""
    listener = socket.create_server(("127.0.0.1", 0))
    opened.append(listener)
    return listener, listener.getsockname()[1]


def test_points_are_those_of_the_simulated_tracker(clock, opened):
    cell = example_cell(simulation=QUIET)
    live = LiveCell(cell, 3, clock)
    truth = live.metrology()
    server = LineStreamServer(live, Told())
    server.start()
    opened.append(server)
    devices = connected(clock, opened, server.ports["tcp"], cell)
    block = read_until(devices, clock, has_points)
    near = truth.read().position[-1]
    np.testing.assert_allclose(block.position[-1], near, atol=1e-7)
    assert block.station == "station_1"
    assert block.beam is BeamState.LOCKED
    assert np.all(block.time <= clock.now() + 1e-6)


def test_a_6d_marker_gives_its_point_as_a_reflector_there_would(clock, opened):
    cell, point = example_cell(simulation=QUIET), ["30 mm", "-20 mm", "55 mm"]
    server = served(clock, opened, Told(settings={"point": (0.03, -0.02, 0.055)}))
    devices = connected(clock, opened, server.ports["tcp"], point=point)
    plain = served(clock, opened)
    reflector = connected(clock, opened, plain.ports["tcp"])
    found = [read_until(each, clock, has_points).position[-1] for each in (devices, reflector)]
    np.testing.assert_allclose(found[0], found[1], atol=1e-6)
    assert cell.file.marker is not None


def test_the_clock_of_the_adapter_is_translated(clock, opened):
    server = served(clock, opened, offset=-4.0, drift=50e-6)
    devices = connected(clock, opened, server.ports["tcp"])
    for _ in range(5):
        block = read_until(devices, clock, has_points)
        assert np.all(block.time <= clock.now() + 1e-6)
        assert block.time[-1] > clock.now() - 1.0


def test_mm_under_a_header_of_m_are_found(clock, opened):
    server = served(clock, opened, unit="m")
    devices = connected(clock, opened, server.ports["tcp"])
    with pytest.raises(DeviceError, match="look like mm, not m: state the right unit"):
        read_until(devices, clock, lambda _: False)


@pytest.mark.parametrize("silent", [False, True])
def test_a_broken_beam_is_told_and_found_again(clock, opened, silent):
    listener, port = site(opened)
    devices = connected(clock, opened, port)
    line, _ = listener.accept()
    with line:
        line.sendall(b"t[s],x[m],y[m],z[m]\n1.0,3,0,2\n")
        read_until(devices, clock, has_points)
        if not silent:
            line.sendall(b"beam broken\n")
        block = read_until(devices, clock, broken)
        assert block.note == (
            "it says nothing" if silent else "the adapter says that the beam is broken"
        )
        line.sendall(b"beam locked\n1.5,3,0,2\n")
        assert read_until(devices, clock, has_points).beam is BeamState.LOCKED


def test_an_adapter_that_goes_is_connected_to_again(clock, opened):
    listener, port = site(opened)
    devices = connected(clock, opened, port)
    for stamp in (b"1", b"2"):
        line, _ = listener.accept()
        with line:
            line.sendall(b"t[s],x[m],y[m],z[m]\n" + stamp + b",3,0,2\n")
            read_until(devices, clock, has_points)
        read_until(devices, clock, broken)


def test_a_station_that_was_started_anew_ends_the_run(clock, opened):
    listener, port = site(opened)
    devices = connected(clock, opened, port)
    for stamp in (b"812.3", b"0.4"):
        line, _ = listener.accept()
        with line:
            line.sendall(b"t[s],x[m],y[m],z[m]\n" + stamp + b",3,0,2\n")
            if stamp == b"0.4":
                with pytest.raises(DeviceError, match="started anew or its clock set"):
                    read_until(devices, clock, lambda _: False)
            else:
                read_until(devices, clock, has_points)


def test_another_frame_ends_the_run(clock, opened):
    server = served(clock, opened)
    devices = connected(clock, opened, server.ports["tcp"])
    read_until(devices, clock, has_points)
    server.frame = "setup 2"
    with pytest.raises(DeviceError, match="its frame was 'setup 1' and is 'setup 2' now"):
        read_until(devices, clock, lambda _: False)


def test_a_fault_of_the_adapter_is_passed_on(clock, opened):
    server = served(clock, opened)
    server.faults.append("error laser is not warm")
    devices = connected(clock, opened, server.ports["tcp"])
    with pytest.raises(DeviceError, match="the adapter says: laser is not warm"):
        read_until(devices, clock, lambda _: False)


def test_the_adapter_is_told_which_station_is_to_look(clock, opened):
    listener, port = site(opened)
    devices = connected(clock, opened, port)
    line, _ = listener.accept()
    with line, line.makefile("rb") as said:
        assert said.readline() == b"look station_1\n"
        devices.metrology.look("station_1")
        assert said.readline() == b"look station_1\n"


def test_nobody_there_is_a_broken_beam_and_at_last_a_fault(clock, opened):
    listener, port = site(opened)
    listener.close()
    devices = connected(clock, opened, port, patience="2 s")
    unheard = read_until(devices, clock, lambda block: block.note != "no point has come yet")
    assert "no connection: Connection refused" in unheard.note
    clock.sleep(3.0)
    with pytest.raises(DeviceError, match="no connection for 3 s"):
        read_until(devices, clock, lambda _: False)


def test_as_server_it_waits_for_the_adapter_and_answers_nobody_else(clock, opened):
    cell = example_cell(simulation=QUIET)
    devices = connect(DRIVER, cell, clock, role="server", peer="127.0.0.2", **FAR)
    opened.append(devices)
    port = devices.metrology.ports[0]
    with socket.create_connection(("127.0.0.1", port)) as stranger:
        stranger.settimeout(PATIENCE)
        assert stranger.recv(10) == b""
    with socket.create_connection(("127.0.0.1", port), source_address=("127.0.0.2", 0)) as friend:
        friend.sendall(b"x[m],y[m],z[m]\n3,0,2\n")
        assert len(read_until(devices, clock, has_points)) == 1


def test_the_simulator_calls_a_server(clock, opened):
    cell = example_cell(simulation=QUIET)
    devices = connect(DRIVER, cell, clock, role="server", **FAR)
    opened.append(devices)
    port = devices.metrology.ports[0]
    served(clock, opened, Told(settings={"role": "server", "port": port}))
    read_until(devices, clock, has_points)


def test_stations_may_have_a_line_each(clock, opened):
    cell = two_stations()
    sites = {name: site(opened) for name in ("near", "far")}
    stations = {name: {"port": port} for name, (_, port) in sites.items()}
    devices = connect(DRIVER, cell, clock, stations=stations, **FAR)
    opened.append(devices)
    for x, (listener, _) in enumerate(sites.values(), 3):
        line, _ = listener.accept()
        opened.append(line)
        line.sendall(f"x[m],y[m],z[m]\n{x},0,2\n".encode())
    assert devices.metrology.stations == ("near", "far")
    assert read_until(devices, clock, has_points).position[0, 0] == 3.0
    devices.metrology.look("far")
    line.sendall(b"4,0,2\n")
    assert read_until(devices, clock, has_points).station == "far"


def test_two_stations_on_one_line_need_their_names(clock, opened):
    listener, port = site(opened)
    devices = connect(DRIVER, two_stations(), clock, port=port, **FAR)
    opened.append(devices)
    line, _ = listener.accept()
    with line:
        line.sendall(b"x[m],y[m],z[m]\n3,0,2\n")
        with pytest.raises(DeviceError, match=r"near, far share a line.*column 'station'"):
            read_until(devices, clock, lambda _: False)


def two_stations():
    data = [
        {"name": name, "position": ["2.4 m", "-4 m", "2.2 m"], "range": ["1 m", "15 m"]}
        for name in ("near", "far")
    ]
    return example_cell(simulation=QUIET, trackers=data)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({}, "give port, or stations"),
        ({"port": 1, "stations": {"near": {"port": 2}}}, "give port, or stations"),
        ({"port": 1, "columns": ["x[mm]", "y[mm]"]}, "no column z"),
        ({"port": 70000}, "65535"),
    ],
)
def test_settings_that_say_nothing_or_too_much_are_refused(settings, message):
    with pytest.raises(ValueError, match=message):
        DRIVER.settings("metrology").model_validate(settings)


def test_a_station_that_the_cell_has_not_is_refused(clock):
    with pytest.raises(ElastocalError, match="no station 'statoin_1'; did you mean 'station_1'"):
        connect(DRIVER, example_cell(), clock, stations={"statoin_1": {"port": 2}})


def test_close_gives_port_and_thread_back(clock):
    devices = connect(DRIVER, example_cell(), clock, role="server", **FAR)
    (port,) = devices.metrology.ports
    devices.close()
    socket.create_server(("127.0.0.1", port)).close()
    assert not any(thread.name.startswith("line_stream") for thread in threading.enumerate())
