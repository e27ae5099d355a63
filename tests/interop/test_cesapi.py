"""The public program ``CESAPI`` reads our simulated tracker, and our commands.

It knows the part of emScon that an AT401 speaks: no streams of points. It is no dependency:
``pip install --no-deps --target DIR CESAPI==1.1.3`` and ``PYTHONPATH=DIR`` run these.
"""

import socket

import numpy as np
import pytest

from elastocal.cell import WallClock
from elastocal.drivers.emscon.driver import Dialogue, EmsconSettings
from elastocal.drivers.emscon.packets import Answer, Code
from elastocal.drivers.stations import StationFeed
from elastocal.sim.wire import LiveCell, Told
from elastocal.sim.wire.emscon import EmsconServer
from elastocal.sim.workcell import SimClock
from support.simulated import QUIET, example_cell

packet_module = pytest.importorskip("CESAPI.packet", reason="CESAPI is not installed")


@pytest.fixture
def live():
    return LiveCell(example_cell(simulation=QUIET), 3, WallClock())


@pytest.fixture
def server(live):
    server = EmsconServer(live, Told(), initialize_time=0.05)
    server.start()
    yield server
    server.close()


def asked(server, *requests, answers):
    """Return the packets that come as an answer, each by the class that CESAPI has for it."""
    factory, data, found = packet_module.PacketFactory(), b"", []
    with socket.create_connection(("127.0.0.1", server.ports["tcp"]), timeout=20.0) as line:
        for request in requests:
            line.sendall(request.pack())
        while len(found) < answers:
            data += line.recv(65536)
            while len(data) >= 4 and len(data) >= (size := int.from_bytes(data[:4], "little")):
                found.append((factory.packet(data[:size]), data[:size]))
                data = data[size:]
    return found


def initialized(server):
    asked(server, packet_module.InitializeCT(), answers=1)


def test_its_classes_take_every_answer_to_its_last_byte(server):
    module, initial = packet_module, packet_module.InitializeCT()
    requests = [
        initial,
        module.SetUnitsCT(),
        module.SetCoordinateSystemTypeCT(),
        module.SetSystemSettingsCT(),
        module.SetStatisticModeCT(),
        module.SetMeasurementModeCT(),
        module.GetReflectorsCT(),
        module.GoBirdBathCT(),
        module.StopMeasurementCT(),
    ]
    found = asked(server, *requests, answers=len(requests) + 2)
    names = {type(packet).__name__ for packet, _ in found}
    assert {"InitializeRT", "SetUnitsRT", "GetReflectorsRT", "StopMeasurementRT"} <= names
    for packet, data in found:
        assert packet.unpack(data) == b"", type(packet).__name__
        assert packet.pack() == data
    reflectors = [p for p, _ in found if type(p).__name__ == "GetReflectorsRT"]
    texts = [p.cReflectorName.decode("utf-16-le").rstrip("\0") for p in reflectors]
    assert texts[0] == "CCR-1.5in"
    assert {p.iTotalReflectors for p in reflectors} == {3}


def test_its_classes_take_errors_and_changes_of_state(server):
    initialized(server)
    server.say_change(25)
    server.say_error(10011)
    (change, error) = (packet for packet, _ in asked(server, answers=2))
    assert change.systemStatusChange == packet_module.ES_SSC_MeasStatus_NotReady
    assert error.status == packet_module.ES_RS_MultiConnectionsNotAllowed


def test_it_reads_a_point_where_the_marker_is(live, server):
    initialized(server)
    find, start = packet_module.FindReflectorCT(), packet_module.StartMeasurementCT()
    units = packet_module.SetUnitsCT()
    units.unitsSettings.lenUnitType = packet_module.ES_LU_Millimeter
    truth = live.metrology()
    found = asked(server, units, find, start, answers=5)
    point = found[-1][0]
    assert type(point).__name__ == "SingleMeasResultT"
    place = np.array([point.dVal1, point.dVal2, point.dVal3])
    np.testing.assert_allclose(place, 1e3 * truth.read().position[-1], atol=1e-6)
    assert (point.dTemperature, point.dPressure, point.dHumidity) == server.weather


@pytest.mark.slow
def test_its_own_program_measures_a_point(live, server):
    from CESAPI.command import CommandSync
    from CESAPI.connection import Connection

    connection, truth = Connection(), live.metrology()
    connection.connect("127.0.0.1", server.ports["tcp"])
    try:
        program = CommandSync(connection)
        program.Initialize()
        program.FindReflector(3.0)
        point = program.StartMeasurement()
    finally:
        connection.disconnect()
    place = np.array([point.dVal1, point.dVal2, point.dVal3])
    np.testing.assert_allclose(place, 1e3 * truth.read().position[-1], atol=1e-6)


def test_its_classes_take_the_commands_that_our_driver_sends():
    clock, factory, known = SimClock(5.0), packet_module.PacketFactory(), 0
    feed = StationFeed(example_cell().file.trackers[0], "emScon", clock)
    dialogue = Dialogue(EmsconSettings(), feed, clock, fresh=True)
    while sent := dialogue.due():
        code = int.from_bytes(sent[8:12], "little")
        dialogue.take(Answer(code, 0))
        if code == Code.SET_CONTINUOUS_TIME:  # an AT401 has no streams
            continue
        packet = factory.packet(sent, return_type=False)
        assert packet.unpack(sent) == b"", code
        assert packet.pack() == sent
        known += 1
    assert known == 9
