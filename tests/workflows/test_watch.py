"""``watch`` over sockets: each device by itself, what is wrong with one, and an arm that stands."""

import socket
import threading
import time

import numpy as np
import pytest
import yaml

from elastocal.cell import LocalPort, RigContext, WallClock, load_cell
from elastocal.drivers.kuka_rsi import RsiSettings
from elastocal.drivers.kuka_rsi.driver import KukaListener
from elastocal.drivers.rtde.driver import RtdeDriver, RtdeSettings
from elastocal.drivers.stations import StationLink
from elastocal.errors import DeviceError
from elastocal.sim.wire import LiveCell
from elastocal.sim.wire.net_ft import NetFtServer
from elastocal.sim.wire.rtde import PORTS, RtdeServer
from elastocal.workflows import WatchResult, studio, watch
from elastocal.workflows._operator_and_devices import rig_of
from support import fault_matrix
from support.cli import elastocal
from support.kuka_peer import KukaPeer
from support.ports import free
from support.run_cells import PlannedCell
from support.simulated import example_cell
from support.ur_client import UrClient
from support.wire_faults import pass_on, steal

UDP = socket.SOCK_DGRAM
PATIENCE = 60.0


def decimal_comma(data: bytes) -> list[bytes]:
    return [data.replace(b".", b",")]


@pytest.fixture
def wired():
    """A cell whose three devices are on the wire, a proxy on each line, and what opens them."""
    return fault_matrix.wired(
        PlannedCell(example_cell("afp").path, None), "wired.yaml", by_the_wall=True
    )


class Watching:
    """A watch in a thread of its own, and what it shows."""

    def __init__(self, cell):
        self.shown: WatchResult | None = None
        self._cell, self._over = cell, threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def _run(self):
        def show(result):
            self.shown = result

        watch(self._cell, show=show, interrupted=self._over.is_set)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._over.set()
        self._thread.join(PATIENCE)

    def device(self, kind):
        shown = self.shown
        return next((each for each in shown.figures.devices if each.kind == kind), None)

    def until(self, kind, holds):
        """Return the first reading of a kind of device that is as wanted."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            found = None if self.shown is None else self.device(kind)
            if found is not None and holds(found):
                return found
            time.sleep(0.01)
        raise AssertionError(self.shown)


def sound(reading):
    return reading.heard and not reading.problem and reading.counts.received > 20


def test_each_device_is_heard_one_that_fails_stops_no_other_and_the_arm_stands(wired):
    found, opened = wired
    with opened() as lines, Watching(found.cell) as watching:
        before = lines.live.press().tool
        arm = watching.until("arm", lambda each: sound(each) and each.cycle is not None)
        assert "program stands, corrections do not act" in arm.cells()[0]
        np.testing.assert_allclose(arm.position, before, atol=1e-4)
        assert arm.delay is not None
        assert arm.offset is not None
        sensor = watching.until("sensor", sound)
        assert np.linalg.norm(sensor.force) > 1.0
        assert watching.until("metrology", sound).state == "locked"

        lines.box.from_device = lambda _: []  # the cable of the box is unplugged
        silent = watching.until("sensor", lambda each: each.problem)
        assert "no record for 0.25 s" in silent.problem
        heard = watching.device("arm").counts.received
        watching.until("arm", lambda each: sound(each) and each.counts.received > heard + 50)
        lines.box.from_device = pass_on
        assert "a run would have ended" in watching.until("sensor", sound).state

        lines.arm.to_device = decimal_comma
        refused = watching.until("arm", lambda each: each.counts and each.counts.malformed > 10)
        assert "decimal comma" in refused.cells()[2]
        watching.until("arm", lambda each: "nothing from the controller" in each.problem)
        assert watching.device("metrology").state == "locked"

        taken = [each.correction for each in lines.robot.taken]
        assert len(taken) > 50
        assert set(taken) == {(0.0, 0.0, 0.0)}
        np.testing.assert_allclose(lines.live.press().tool, before, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("fault", sorted(fault_matrix.FAULTS.keys() - {"PC: killed"}))
def test_no_fault_moves_the_arm_or_hides_another_device_and_mended_it_is_heard(wired, fault):
    found, opened = wired
    kinds = {"arm": "arm", "force": "sensor", "tracker": "metrology"}
    broken = kinds[fault.split(":")[0]]
    with opened() as lines, Watching(found.cell) as watching:
        before = lines.live.press().tool
        for kind in kinds.values():
            watching.until(kind, sound)
        seconds = watching.shown.figures.seconds
        fault_matrix.FAULTS[fault](lines)
        watching.until("arm", lambda _: watching.shown.figures.seconds > seconds + 2.0)
        for kind in set(kinds.values()) - {broken}:
            watching.until(kind, sound)
        lines.mend()
        if fault != "force: second client":  # a stream that was taken is left to whoever took it
            watching.until(broken, sound)
        assert {each.correction for each in lines.robot.taken} == {(0.0, 0.0, 0.0)}
        np.testing.assert_allclose(lines.live.press().tool, before, atol=1e-9)


@pytest.mark.slow
def test_a_stream_that_another_client_has_taken_is_left_to_it(wired, monkeypatch):
    found, opened = wired
    asked, obey = [], NetFtServer._obey
    monkeypatch.setattr(
        NetFtServer, "_obey", lambda box, *said: (asked.append(said), obey(box, *said))
    )
    with opened() as lines, Watching(found.cell) as watching:
        watching.until("sensor", sound)
        before = len(asked)
        steal(lines.box_port)
        robbed = watching.until("sensor", lambda each: each.problem)
        watching.until("sensor", lambda each: "another client has taken" in each.problem)
        assert robbed.heard
        seconds = watching.shown.figures.seconds
        watching.until("arm", lambda _: watching.shown.figures.seconds > seconds + 1.5)
        assert len(asked) == before + 1  # the thief alone


@pytest.mark.slow
def test_a_device_in_use_is_left_to_its_program_and_the_others_are_shown(wired):
    found, opened = wired
    rig = rig_of(load_cell(found.cell))
    with opened(), Watching(found.cell) as watching:
        watching.until("sensor", sound)
        with pytest.raises(DeviceError, match="is in use by elastocal watch"), rig.reserved("run"):
            pass
    with opened(), rig.reserved("run", ("sensor",)), Watching(found.cell) as watching:
        watching.until("arm", sound)
        used = watching.until("sensor", lambda each: "in use by" in each.problem)
        assert " is in use by elastocal run " in used.problem
        assert not used.heard


def test_what_was_never_heard_is_named_in_one_line_and_the_exit_code_is_1(wired):
    found, _ = wired
    reason = elastocal("watch", found.cell, "--for", "0.5 s", "--json")
    assert reason.code == 1
    (line,) = reason.err.strip().splitlines()
    port = load_cell(found.cell).file.devices.arm.told["port"]
    assert f"nothing heard yet from 127.0.0.1 at 127.0.0.1 port {port} (no datagram came)" in line
    assert "sensor net_ft" in line
    assert "Net F/T at 127.0.0.1 does not answer: Connection refused" in line
    assert "no connection: Connection refused" in line


def test_simulated_devices_are_watched_too_without_a_terminal_a_line_each():
    shown = elastocal("watch", example_cell("afp").path, "--for", "0.6 s")
    assert shown.code == 0, shown.err
    arm, sensor, metrology = shown.err.strip().splitlines()
    assert arm.startswith("arm simulated arm: disarmed  ")
    assert " N; " in sensor
    assert ": locked  " in metrology


@pytest.mark.parametrize("mode", ["measure", "contact", "compensation"])
def test_a_kuka_is_answered_in_contact_alone_by_no_movement_and_hold(mode):
    cell = example_cell("afp")
    port = LocalPort("udp", "127.0.0.1", free(UDP))
    settings = RsiSettings.model_validate({"mode": mode, "port": port.port})
    listener = KukaListener(cell, settings, RigContext(WallClock(), 0, 0.0, None, watches=True))
    peer = KukaPeer(cell)
    peer.state = 2  # guided: what is sent would act
    devices, answers = listener.devices(), []
    try:
        for _ in range(40):
            answers.append(listener._link.answer(peer.rob(), ("127.0.0.1", 7)))
            peer.ipoc += 4
        (reading,) = devices.readings()
    finally:
        devices.close()
    assert reading.heard
    assert reading.cycle is not None
    assert "in RSI_MOVECORR, corrections act" in reading.state
    np.testing.assert_allclose(reading.position, cell.robot.forward(cell.home)[:3, 3], atol=1e-6)
    if mode != "contact":
        assert answers == [None] * 40
        return
    zero = b'<RKorr X="0.000000" Y="0.000000" Z="0.000000" A="0.000000" B="0.000000" C="0.000000"/>'
    assert all(b"<Stop>1</Stop>" in each and zero in each for each in answers)
    assert all(b'Op="0"' in each for each in answers)


def test_what_would_keep_a_kuka_from_being_enabled_is_shown():
    cell = example_cell("afp")
    settings = RsiSettings.model_validate({"mode": "contact", "port": free(UDP)})
    listener = KukaListener(cell, settings, RigContext(WallClock(), 0, 0.0, None, watches=True))
    peer = KukaPeer(cell)
    devices, link = listener.devices(), listener._link
    try:
        moved = peer.rob().replace(b'<RIst X="', b'<RIst X="9')
        link.answer(moved, ("127.0.0.1", 7))
        assert "check $TOOL, $BASE, signs of the axes" in devices.readings()[0].problem
        link.answer(peer.rob().replace(b"<RSol", b"<Other"), ("127.0.0.1", 7))
        peer.ipoc += 4
        link.answer(peer.rob().replace(b"<RSol", b"<Other"), ("127.0.0.1", 7))
        assert "the controller does not send RSol" in devices.readings()[0].problem
    finally:
        devices.close()


def test_a_ur_is_listened_to_and_its_program_is_not_touched():
    cell = example_cell("ur20")
    clock = WallClock()
    server = RtdeServer(LiveCell(cell, 3, clock), dict.fromkeys(PORTS, 0))
    server.start()
    client = UrClient(server)

    def control(*_):
        raise AssertionError("the commanding half was opened")

    wanted = {"arm": RtdeSettings(), "sensor": RtdeSettings()}
    context = RigContext(clock, 0, 0.0, None, watches=True)
    found = RtdeDriver(lambda *_: client, control).connect(cell, wanted, context)
    try:
        arm, sensor = found.readings()
    finally:
        found.close()
        server.close()
    assert (found.arm, found.sensor) == (None, None)
    np.testing.assert_allclose(arm.position, cell.robot.forward(cell.home)[:3, 3], atol=0.02)
    assert arm.offset is not None
    assert sensor.force is not None


class Refusing(StationLink):
    """A line whose device says something that ends a run."""

    calls = 0

    def hear(self):
        self.calls += 1
        raise DeviceError("the adapter says: no battery")


def test_a_line_that_is_only_watched_is_tried_again_whatever_it_said(monkeypatch):
    monkeypatch.setattr("elastocal.drivers.stations._AGAIN", 0.01)
    tried = {}
    for patience in (1.0, RigContext(WallClock(), 0, 0.0, None, watches=True).patience(1.0)):
        link = Refusing("line", (), WallClock(), patience)
        link.start()
        end = time.monotonic() + PATIENCE
        while link.is_alive() and link.calls < 3 and time.monotonic() < end:
            time.sleep(0.01)
        link.close()
        tried[patience] = link.calls
    assert tried == {1.0: 1, float("inf"): tried[float("inf")]}
    assert tried[float("inf")] >= 3


def test_a_watch_of_a_cell_that_names_no_driver_is_refused(tmp_path):
    data = yaml.safe_load(example_cell("afp").path.read_text()) | {"devices": {"arm": "kuka"}}
    cell = example_cell("afp").path.with_name("other.yaml")
    cell.write_text(yaml.safe_dump(data))
    assert "devices.arm: unknown driver 'kuka'" in elastocal("watch", cell).reason


@pytest.mark.slow
def test_the_studio_shows_the_same_rows_and_ends_the_watch():
    told = []

    def look(found):
        session = found.session
        session.actions["watch"]({})
        end, number = time.monotonic() + PATIENCE, -1
        while time.monotonic() < end:
            number, news = session.news(number, 1.0)
            rows = news["work"]["live"].get("devices", ())
            if [each["wrong"] for each in rows] == [False] * 3:
                told.append(rows)
                session.actions["stop"]({})
            if news["work"]["state"] != "busy":
                break
        told.append(news["work"]["state"])

    studio(example_cell("afp").path, while_open=look)
    *_, rows, state = told
    assert state == "stopped"
    assert [each["device"].split()[0] for each in rows] == ["arm", "sensor", "metrology"]
    assert "disarmed" in rows[0]["cells"][0]
