"""The emScon driver against the simulated controller, and against a dialogue without a line."""

import socket

import numpy as np
import pytest

from elastocal.cell import BeamState, RigContext
from elastocal.drivers.emscon import DRIVER
from elastocal.drivers.emscon.driver import Dialogue, EmsconSettings
from elastocal.drivers.emscon.packets import Answer, Code, Complaint, StatusChange
from elastocal.drivers.stations import StationFeed
from elastocal.errors import DeviceError
from elastocal.sim.wire import LiveCell, Told
from elastocal.sim.wire.emscon import EmsconServer
from elastocal.sim.workcell import SimClock
from support.simulated import QUIET, example_cell
from support.stations_on_wire import connect, read_until
from support.waiting import until

QUICK = {"silence": "1 s", "patience": "1000 s"}


def has_points(block):
    return len(block) > 0


@pytest.fixture
def clock():
    return SimClock(5.0)


@pytest.fixture
def opened():
    things = []
    yield things
    for thing in reversed(things):
        thing.close()


@pytest.fixture
def live(clock):
    return LiveCell(example_cell(simulation=QUIET), 3, clock)


@pytest.fixture
def server(live, opened):
    server = EmsconServer(live, Told())
    opened.append(server)
    server.start()
    return server


def connected(clock, opened, server, **settings):
    cell = example_cell(simulation=QUIET)
    devices = connect(DRIVER, cell, clock, port=server.ports["tcp"], **(QUICK | settings))
    opened.append(devices)
    return devices


def refused(devices, clock):
    with pytest.raises(DeviceError) as caught:
        read_until(devices, clock, lambda _: False)
    return str(caught.value)


@pytest.mark.parametrize("marker", ["reflector", "probe"])
def test_points_are_those_of_the_simulated_tracker(clock, live, server, opened, marker):
    truth = live.metrology()
    devices = connected(clock, opened, server, marker=marker, reflector="CCR-1.5in")
    block = read_until(devices, clock, has_points)
    np.testing.assert_allclose(block.position[-1], truth.read().position[-1], atol=1e-9)
    assert block.source == f"emScon 127.0.0.1:{server.ports['tcp']}"
    assert np.all(block.time <= clock.now() + 1e-6)


def test_a_tracker_that_is_only_watched_is_not_initialised_and_says_so(clock, live, server, opened):
    cell, settings = example_cell(simulation=QUIET), {"port": server.ports["tcp"], **QUICK}
    wanted = {"metrology": EmsconSettings.model_validate(settings)}
    found = DRIVER.connect(cell, wanted, RigContext(clock, 0, 0.0, None, watches=True))
    opened.append(found)

    def shown():
        return found.readings()[0]

    until(lambda: "the tracker is not initialised" in shown().state)
    assert shown().heard
    assert not server._initialized
    server._initialized = True  # by the maker's own program
    until(lambda: (clock.sleep(0.02), shown().state == "locked")[1])
    assert shown().offset is not None


def test_a_point_of_a_probe_is_turned_with_it(clock, live, opened):
    server = EmsconServer(live, Told(settings={"point": (0.03, -0.02, 0.055)}))
    opened.append(server)
    server.start()
    truth = live.metrology()
    point = ["30 mm", "-20 mm", "55 mm"]
    devices = connected(clock, opened, server, marker="probe", point=point)
    block = read_until(devices, clock, has_points)
    np.testing.assert_allclose(block.position[-1], truth.read().position[-1], atol=1e-9)


def test_the_order_of_commands_ends_in_a_search_and_a_start():
    assert codes(EmsconSettings(reflector="CCR-1.5in", bird_bath=True)) == [
        Code.STOP_MEASUREMENT,
        Code.SET_UNITS,
        Code.INITIALIZE,
        Code.SET_SYSTEM_SETTINGS,
        Code.SET_COORDINATE_SYSTEM,
        Code.SET_STATISTIC_MODE,
        Code.SET_MEASUREMENT_MODE,
        Code.SET_CONTINUOUS_TIME,
        Code.GET_REFLECTORS,
    ]


def codes(settings):
    """Return the commands up to the first that is not answered by a status alone."""
    dialogue, _, found = dialogue_of(settings)
    while packet := dialogue.due():
        found.append(Code(int.from_bytes(packet[8:12], "little")))
        dialogue.take(Answer(found[-1], 0 if found[-1] != Code.GET_REFLECTORS else 1))
        if found[-1] is Code.GET_REFLECTORS:
            break
    return found


def dialogue_of(settings, **figures):
    clock = SimClock(5.0)
    feed = StationFeed(example_cell().file.trackers[0], "emScon", clock)
    return Dialogue(settings, feed, clock, **({"fresh": True} | figures)), clock, []


def set_up(dialogue):
    while packet := dialogue.due():
        dialogue.take(Answer(int.from_bytes(packet[8:12], "little"), 0))
    assert dialogue.ready
    return dialogue


def test_a_broken_beam_is_searched_and_measured_again(clock, opened):
    fault = {"kind": "beam_break", "pose": 0, "step": "approach", "duration": "0.5 s"}
    cell = example_cell(simulation=QUIET, faults=[fault])
    live = LiveCell(cell, 3, clock)
    server = EmsconServer(live, Told())
    opened.append(server)
    server.start()
    devices = connected(clock, opened, server)
    read_until(devices, clock, has_points)
    arm = live.arm()
    arm.enable()
    arm.approach(np.array([0.0, 0.0, -1.0]), 0.01, 0.005, 100.0)
    block = read_until(devices, clock, lambda block: block.beam is BeamState.BROKEN)
    assert "not ready" in block.note
    read_until(devices, clock, looking(devices, has_points))


def looking(devices, wanted):
    """Return the same wish, with a look each time, as the supervision cycle repeats it."""

    def wish(block):
        if block.beam is BeamState.BROKEN:
            devices.metrology.look("station_1")
        return wanted(block)

    return wish


def test_a_search_without_a_marker_leaves_the_beam_broken():
    dialogue, _, _ = dialogue_of(EmsconSettings())
    set_up(dialogue)
    dialogue.take(StatusChange(25))
    dialogue.look()
    assert int.from_bytes(dialogue.due()[8:12], "little") == Code.FIND_REFLECTOR
    dialogue.look()
    dialogue.take(Answer(Code.FIND_REFLECTOR, 10004))
    assert dialogue.due() == b"", "no start without a marker"
    dialogue.look()
    assert dialogue.due() != b""


def test_a_tracker_that_measures_already_is_no_fault():
    dialogue, _, _ = dialogue_of(EmsconSettings())
    while packet := dialogue.due():
        code = int.from_bytes(packet[8:12], "little")
        dialogue.take(Answer(code, 1 if code == Code.START_MEASUREMENT else 0))
    assert dialogue.ready


def test_a_busy_server_is_asked_again(clock, server, opened):
    server.busy = 2
    devices = connected(clock, opened, server)
    read_until(devices, clock, has_points)
    assert server.busy == 0


@pytest.mark.parametrize(
    ("quality", "message"),
    [(2, "speed exceeded"), (3, "prism error"), (4, "trigger")],
)
def test_points_of_bad_quality_are_left_out_and_the_reason_is_told(
    clock, server, opened, quality, message
):
    devices = connected(clock, opened, server)
    read_until(devices, clock, has_points)
    server.quality = quality
    block = read_until(devices, clock, lambda block: block.beam is BeamState.BROKEN)
    assert message in block.note
    server.quality = 1
    read_until(devices, clock, has_points)


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        (("say_error", 57), "temperature, pressure or humidity is out of range"),
        (("say_error", 38), "no tracker is connected"),
        (("say_change", 999), "its server was started anew: its frame may be another one"),
        (("say_change", 851), "its sensor was disconnected"),
        (("say_change", 6), "another program has changed its units"),
        (("say_change", 15), "another program has changed its station orientation"),
        (("lose_power",), "was started anew"),
    ],
)
def test_a_tracker_out_of_order_is_named(clock, server, opened, fault, message):
    devices = connected(clock, opened, server)
    read_until(devices, clock, has_points)
    name, *codes = fault
    getattr(server, name)(*codes)
    assert message in refused(devices, clock)


@pytest.mark.parametrize(
    ("weather", "message"),
    [
        ((20.0, 0.0, 50.0), "its pressure is 0 mbar"),
        ((68.0, 1013.0, 50.0), "its temperature is 68"),
    ],
)
def test_weather_that_cannot_be_is_named(clock, server, opened, weather, message):
    server.weather = weather
    assert message in refused(connected(clock, opened, server), clock)


def test_a_tracker_that_stays_in_mm_is_found(clock, server, opened):
    server.units_stay = True
    devices = connected(clock, opened, server)
    assert "look like mm, not m" in refused(devices, clock)


def test_a_second_program_is_told_of_the_first(clock, server, opened):
    with socket.create_connection(("127.0.0.1", server.ports["tcp"])):
        until(lambda: len(server.peers) == 1)
        assert "another program holds the tracker" in refused(
            connected(clock, opened, server), clock
        )


def test_a_reflector_that_it_does_not_know_is_named_with_those_that_it_knows(clock, server, opened):
    devices = connected(clock, opened, server, reflector="CCR-1.5 in")
    message = "no reflector 'CCR-1.5 in'; did you mean 'CCR-1.5in'? (reflectors: CCR-1.5in, CCR"
    assert message in refused(devices, clock)


def test_a_refused_command_is_named(clock, server, opened):
    server.refusal = 10010
    assert "Start measurement: the tracker is not level (status 10010)" in refused(
        connected(clock, opened, server), clock
    )


def test_no_answer_is_a_fault_after_a_while():
    dialogue, clock, _ = dialogue_of(EmsconSettings(patience="60 s"))
    assert dialogue.due()
    clock.sleep(61.0)
    with pytest.raises(DeviceError, match="no answer to Stop measurement"):
        dialogue.due()


def test_an_error_packet_for_the_command_that_waits_is_its_answer():
    dialogue, _, _ = dialogue_of(EmsconSettings())
    dialogue.due()
    dialogue.take(Answer(Code.STOP_MEASUREMENT, 0))
    dialogue.due()
    with pytest.raises(DeviceError, match="Set units: a parameter is wrong"):
        dialogue.take(Complaint(Code.SET_UNITS, 3))


def test_what_is_no_tracker_is_named(clock, opened):
    listener = socket.create_server(("127.0.0.1", 0))
    opened.append(listener)
    cell = example_cell(simulation=QUIET)
    devices = connect(DRIVER, cell, clock, port=listener.getsockname()[1], **QUICK)
    opened.append(devices)
    line, _ = listener.accept()
    with line:
        line.sendall(b"SSH-2.0-OpenSSH_9.2\r\n")
        assert "this is no emScon server" in refused(devices, clock)


def test_several_stations_need_an_address_each(clock):
    data = [
        {"name": name, "position": ["2.4 m", "-4 m", "2.2 m"], "range": ["1 m", "15 m"]}
        for name in ("near", "far")
    ]
    cell = example_cell(trackers=data)
    with pytest.raises(DeviceError, match="near, far: emScon needs an address for each"):
        connect(DRIVER, cell, clock)
