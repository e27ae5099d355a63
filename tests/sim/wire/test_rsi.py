"""The simulated KRC: what corrections do to the arm, and what it says and hears on the wire."""

import re
import socket
from collections import deque

import numpy as np
import pytest

from elastocal.cell import WallClock
from elastocal.errors import DeviceError
from elastocal.sim.arm.statics import EquilibriumError
from elastocal.sim.wire import LiveCell, Told
from elastocal.sim.wire._rsi_messages import (
    EthernetConfig,
    PosCorrLimits,
    RobWriter,
    RsiStopError,
    SenReader,
)
from elastocal.sim.wire.rsi import (
    IPOC_START,
    RsiContext,
    RsiRobot,
    RsiServer,
    corrected_program,
    ethernet_config,
    rsi_server,
)
from elastocal.sim.workcell import SimClock
from support.simulated import QUIET, example_cell, places

CYCLE = 0.004
GUIDE, PTP = 1, 2


class Desk:
    """A controller that is stepped by hand, and what its PC wants."""

    def __init__(self, absolute=False, **context):
        self.clock = SimClock()
        self.live = LiveCell(example_cell(simulation=QUIET), 0, self.clock)
        mode = "compensation" if absolute else "contact"
        config = EthernetConfig.from_xml(ethernet_config("127.0.0.1", 49152, mode))
        self.robot = RsiRobot(self.live, config.receive, RsiContext(absolute=absolute, **context))
        self.robot.start()
        self.wanted = {"Stop": 1.0, "Cmd.N": 0.0, "Cmd.Op": 0.0, "Cmd.V": 100.0}

    def cycle(self, *, heard=True, **corrections):
        """Let a cycle pass, its answer heard or not, and return what the robot says then."""
        correction = {f"RKorr.{axis}": value for axis, value in corrections.items()}
        self.robot.cycle(self.wanted | correction if heard else None)
        self.clock.sleep(CYCLE)
        return self.robot.values()

    def repeat(self, count, **corrections):
        for _ in range(count):
            said = self.cycle(**corrections)
        return said

    def until(self, state, most=2000):
        for _ in range(most):
            if self.cycle()["Krl.State"] == state:
                return self.robot.values()
        raise AssertionError(f"state {self.robot.values()['Krl.State']}")

    def guide(self):
        self.wanted |= {"Cmd.Op": GUIDE, "Stop": 0.0}
        return self.until(2)

    def point_to_point(self, q, speed=100.0):
        degrees = np.degrees(q[1:])
        self.wanted |= {f"Ax.A{k + 1}": value for k, value in enumerate(degrees)}
        self.wanted |= {"Ex.E1": 1e3 * q[0], "Cmd.V": speed, "Cmd.Op": PTP, "Stop": 1.0}
        self.wanted["Cmd.N"] += 1

    def at_place(self):
        self.point_to_point(places()[1].q_approach)
        self.until(4)
        self.wanted["Cmd.Op"] = 0
        self.until(1)


@pytest.fixture
def desk():
    return Desk()


class TestCorrections:
    @pytest.mark.parametrize(("delay", "cycles"), [(0.004, 1), (0.012, 3), (0.12, 30)])
    def test_a_correction_moves_the_actual_pose_after_the_delay(self, delay, cycles):
        desk = Desk(delay=delay)
        before = desk.guide()
        said = [desk.cycle(X=0.1)]
        said += [desk.cycle() for _ in range(cycles + 1)]
        x = [each["RIst"][0] - before["RIst"][0] for each in said]
        np.testing.assert_allclose(x[: cycles - 1], 0.0, atol=1e-7)
        np.testing.assert_allclose(x[cycles - 1 :], 0.1, atol=1e-3)
        for each in said:
            assert each["RSol"] == before["RSol"]
            assert each["ASPos"] == before["ASPos"]
        assert said[-1]["AIPos"] != before["AIPos"]

    def test_relative_ones_add_up_and_a_missing_answer_adds_nothing(self, desk):
        before = desk.guide()
        for heard in (True, True, False, True):
            desk.cycle(heard=heard, Z=0.05)
        after = desk.repeat(5)
        assert after["RIst"][2] - before["RIst"][2] == pytest.approx(0.15, abs=1e-5)

    def test_absolute_ones_are_kept_while_no_answer_comes(self):
        desk = Desk(absolute=True, program=corrected_program)
        before = desk.until(2)
        desk.wanted = {"Stop": 0.0}
        desk.repeat(5, Y=0.1)
        after = desk.repeat(10, heard=False)
        assert after["RIst"][1] - before["RIst"][1] == pytest.approx(0.1, abs=1e-5)

    def test_they_do_nothing_while_the_program_stands(self, desk):
        before = desk.until(1)
        after = desk.repeat(10, X=0.1)
        assert after["RIst"] == before["RIst"]

    def test_poscorr_clamps_and_says_nothing(self):
        desk = Desk(limits=PosCorrLimits(upper=(1e-3, 1e-3, 1e-3)))
        before = desk.guide()
        after = desk.repeat(30, X=0.1)
        assert after["RIst"][0] - before["RIst"][0] == pytest.approx(1.0, abs=1e-5)

    def test_poscorrmon_stops_the_arm(self):
        desk = Desk(limits=PosCorrLimits(monitor_way=1.05e-3))
        desk.guide()
        desk.repeat(10, X=0.1)
        with pytest.raises(RsiStopError, match=r"KSS29000 POSCORRMON: correction 1\.100 mm"):
            desk.cycle(X=0.1)

    def test_a_turn_is_about_the_axes_of_base(self, desk):
        before = desk.guide()
        desk.repeat(100, A=0.01)
        after = desk.repeat(5)
        turn = rotation(after["RIst"]) @ rotation(before["RIst"]).T
        np.testing.assert_allclose(turn, rotation([0, 0, 0, 1.0, 0, 0]), atol=1e-6)
        np.testing.assert_allclose(after["RIst"][:3], before["RIst"][:3], atol=1e-4)

    def test_near_the_wrist_singularity_an_axis_would_be_too_fast(self, desk):
        q = places()[1].q_approach.copy()
        q[-2] = np.radians(0.05)
        desk.point_to_point(q)
        desk.until(4)
        desk.guide()
        axis = rotation(desk.robot.values()["RIst"]) @ [0.0, 1.0, 0.0]
        with pytest.raises(RsiStopError, match=r"KSS00421 command velocity of joint_a[46] is 1"):
            desk.repeat(20, **dict(zip("ABC", 0.05 * axis[::-1], strict=True)))


class TestProgram:
    def test_a_target_is_reached_and_said_to_be(self, desk):
        q = places()[1].q_approach
        desk.point_to_point(q, 50.0)
        assert desk.until(3)["Krl.N"] == 0
        said = desk.until(4)
        assert said["Krl.N"] == 1
        np.testing.assert_allclose(said["AIPos"], np.degrees(q[1:]), atol=1e-9)
        assert said["EIPos"] == pytest.approx([1e3 * q[0]])

    def test_a_target_is_given_up_when_the_pc_wants_to_stand(self, desk):
        desk.point_to_point(places()[1].q_approach, 10.0)
        desk.until(3)
        desk.wanted["Cmd.Op"] = 0
        before = desk.until(1)
        assert before["Krl.N"] == 1
        assert desk.cycle()["AIPos"] == before["AIPos"]
        assert before["ASPos"] == pytest.approx(before["AIPos"])

    def test_the_rising_stop_ends_the_guidance_and_the_correction_stays(self, desk):
        before = desk.guide()
        desk.cycle(X=0.1)
        desk.wanted |= {"Cmd.Op": 0, "Stop": 1.0}
        after = desk.until(1)
        assert after["RIst"][0] - before["RIst"][0] == pytest.approx(0.1, abs=1e-3)
        assert after["RSol"] == before["RSol"]

    def test_a_correction_stays_on_top_of_a_target(self, desk):
        desk.guide()
        desk.repeat(30, X=0.1)
        desk.wanted |= {"Cmd.Op": 0, "Stop": 1.0}
        desk.until(1)
        desk.point_to_point(places()[1].q_approach)
        said = desk.until(4)
        off = np.array(said["RIst"]) - said["RSol"]
        np.testing.assert_allclose(off, [3.0, 0, 0, 0, 0, 0], atol=1e-6)
        np.testing.assert_allclose(said["ASPos"], np.degrees(places()[1].q_approach[1:]), atol=1e-9)

    def test_a_target_beyond_the_end_switches_stops_the_program(self, desk):
        q = places()[1].q_approach.copy()
        q[1] = 4.0
        desk.point_to_point(q)
        with pytest.raises(RsiStopError, match="joint target joint_a1"):
            desk.until(4)

    def test_it_ends_when_told(self, desk):
        desk.wanted["Cmd.Op"] = 9
        desk.repeat(10)
        assert desk.robot.ended

    @pytest.mark.slow
    def test_pressing_shows_in_the_sensor_of_the_cell(self, desk):
        desk.at_place()
        sensor, normal = desk.live.sensor(), places()[1].normal
        desk.guide()
        down = dict(zip("XYZ", -0.4 * normal, strict=True))
        slow = dict(zip("XYZ", -0.02 * normal, strict=True))
        tare = sensor.read().force[-1]

        def force():
            block = sensor.read().force
            return 0.0 if not len(block) else np.linalg.norm(block[-1] - tare)

        for _ in range(240):
            desk.cycle(**down)
        assert force() < 30.0
        for _ in range(2000):
            desk.cycle(**slow)
            if force() > 800.0:
                break
        else:
            raise AssertionError("no force")
        for _ in range(200):
            desk.cycle(**{axis: -value for axis, value in slow.items()})
        assert force() < 400.0


def rotation(frame):
    a, b, c = np.radians(frame[3:])
    (ca, cb, cc), (sa, sb, sc) = np.cos([a, b, c]), np.sin([a, b, c])
    return np.array(
        [
            [ca * cb, ca * sb * sc - sa * cc, ca * sb * cc + sa * sc],
            [sa * cb, sa * sb * sc + ca * cc, sa * sb * cc - ca * sc],
            [-sb, cb * sc, cb * cc],
        ]
    )


class TestMessages:
    def test_a_datagram_looks_as_public_programs_expect_it(self):
        config = EthernetConfig.from_xml(
            "<ROOT><CONFIG><IP_NUMBER>192.168.1.10</IP_NUMBER><PORT>59152</PORT>"
            "<SENTYPE>KROSHU</SENTYPE><ONLYSEND>FALSE</ONLYSEND></CONFIG><SEND><ELEMENTS>"
            '<ELEMENT TAG="DEF_RIst" TYPE="DOUBLE" INDX="INTERNAL"/>'
            '<ELEMENT TAG="DEF_Delay" TYPE="LONG" INDX="INTERNAL"/>'
            '<ELEMENT TAG="Digout.o1" TYPE="BOOL" INDX="2"/>'
            '<ELEMENT TAG="DiL" TYPE="LONG" INDX="1"/>'
            '<ELEMENT TAG="Digout.o2" TYPE="BOOL" INDX="3"/></ELEMENTS></SEND></ROOT>'
        )
        assert (config.address, config.port, config.sentype) == ("192.168.1.10", 59152, "KROSHU")
        writer = RobWriter(config.send, 4)
        said = {"RIst": [1620.9999, 0, 1909.9998, 0, 90, 0], "Delay": 15, "Digout.o2": 1}
        assert writer.write(said, 357) == (
            b'<Rob Type="KUKA"><RIst X="1620.9999" Y="0.0000" Z="1909.9998" A="0.0000" B="90.0000"'
            b' C="0.0000"/><Delay D="15"/><Digout o1="0" o2="1"/><DiL>0</DiL><IPOC>357</IPOC></Rob>'
        )

    @pytest.mark.parametrize(
        "element",
        ['TAG="DEF_RTst" TYPE="DOUBLE" INDX="INTERNAL"', 'TAG="X" TYPE="REAL" INDX="1"',
         'TAG="X" TYPE="LONG" INDX="65"', 'TAG="DEF_RIst" TYPE="DOUBLE" INDX="3"',
         'TAG="X" TYPE="LONG" INDX="1"/><ELEMENT TAG="Y" TYPE="LONG" INDX="1"'],
    )  # fmt: skip
    def test_a_config_that_a_controller_refuses_is_refused(self, element):
        with pytest.raises(DeviceError, match="RSI_CREATE"):
            EthernetConfig.from_xml(
                "<ROOT><CONFIG><PORT>1</PORT></CONFIG><SEND><ELEMENTS>"
                f"<ELEMENT {element}/></ELEMENTS></SEND></ROOT>"
            )

    @pytest.mark.parametrize(
        "datagram",
        [b"", b"<Sen", b"\xff\xfe", b'<Sen Type="other"><IPOC>4</IPOC></Sen>',
         b'<Sen Type="elastocal"></Sen>', b'<Rob Type="elastocal"><IPOC>4</IPOC></Rob>',
         b'<!DOCTYPE a [<!ENTITY b "c">]><Sen Type="elastocal"><IPOC>4</IPOC></Sen>',
         b'<Sen Type="elastocal"><IPOC>4</IPOC>' + 70_000 * b" " + b"</Sen>"],
    )  # fmt: skip
    def test_an_answer_that_a_controller_does_not_take_has_not_come(self, datagram):
        config = EthernetConfig.from_xml(ethernet_config("127.0.0.1", 1))
        assert SenReader(config.receive, config.sentype).read(datagram) is None

    def test_a_channel_that_is_no_number_has_not_come(self):
        config = EthernetConfig.from_xml(ethernet_config("127.0.0.1", 1))
        answer = SenReader(config.receive, config.sentype).read(
            b'<Sen Type="elastocal"><RKorr X="1.5" Y="nan" Z=""/><Stop>1</Stop><IPOC>8</IPOC></Sen>'
        )
        assert answer.ipoc == 8
        assert answer.values == {"RKorr.X": 1.5, "Stop": 1.0}


class Pc:
    """A PC on the wire that answers every datagram, or as it is asked to."""

    def __init__(self):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(5.0)
        self.heard = deque()
        self.sources = []

    @property
    def port(self):
        return self.socket.getsockname()[1]

    def hear(self):
        """Return the next datagram and its IPOC; -1 where it has none."""
        data, source = self.socket.recvfrom(65536)
        self.sources.append(source)
        found = re.search(rb"<IPOC>(\d+)</IPOC>", data)
        return data, int(found[1]) if found else -1

    def answer(self, ipoc, inside=b"", kind=b"elastocal"):
        text = b'<Sen Type="%s">%s<IPOC>%d</IPOC></Sen>' % (kind, inside, ipoc)
        self.socket.sendto(text, self.sources[-1])

    def exchange(self, count, inside=b""):
        """Answer so many datagrams; return their IPOCs."""
        ipocs = []
        for _ in range(count):
            ipocs.append(self.hear()[1])
            self.answer(ipocs[-1], inside)
        return ipocs


@pytest.fixture
def wire():
    """Return what starts a controller that sends to a PC; its time runs fifty times as fast."""
    opened = []

    def start(pc, mode="contact", faults=(), **context):
        live = LiveCell(example_cell(simulation=QUIET), 0, WallClock(rate=50.0))
        text = ethernet_config("127.0.0.1", pc.port, mode)
        context = RsiContext(**{"patience": 5.0} | context)
        server = RsiServer(live, EthernetConfig.from_xml(text), context)
        opened.extend([server.close, pc.socket.close])
        server.inject(*faults, after=2)
        server.start()
        return server

    yield start
    for close in opened:
        close()


class TestWire:
    def test_each_cycle_counts_the_milliseconds_on(self, wire):
        pc = Pc()
        server = wire(pc)
        ipocs = pc.exchange(20)
        assert ipocs == list(range(IPOC_START, IPOC_START + 80, 4))
        assert set(pc.sources) == {("127.0.0.1", server.port)}
        assert server.ports == {"udp": pc.port, "robot": server.port}

    def test_nothing_is_late_before_the_first_answer(self, wire):
        pc = Pc()
        server = wire(pc, patience=0.0, timeout=5)
        for _ in range(50):
            data, _ = pc.hear()
        assert b'<Delay D="0"/>' in data
        assert server.statistics.stops == []

    def test_silence_stops_the_controller_until_an_operator_resets_it(self, wire):
        pc = Pc()
        server = wire(pc, patience=0.05, timeout=3)
        pc.exchange(3)
        counts = []
        for _ in range(4):
            data, _ = pc.hear()
            counts.append(int(re.search(rb'Delay D="(\d+)"', data)[1]))
        assert counts == [0, 1, 2, 3]
        pc.socket.settimeout(0.2)
        with pytest.raises(TimeoutError):
            pc.hear()
        assert server.statistics.stops == [
            "KSS29002 SEN: RSI execution error: no valid answer for 4 cycles"
        ]
        pc.socket.settimeout(5.0)
        server.reset()
        assert pc.exchange(2)[0] < IPOC_START

    def test_an_answer_to_another_cycle_or_of_another_type_has_not_come(self, wire):
        pc = Pc()
        server = wire(pc, patience=0.05)
        pc.exchange(2)
        pc.answer(pc.hear()[1] - 4)
        pc.answer(pc.hear()[1], kind=b"ImFree")
        assert b'<Delay D="2"/>' in pc.hear()[0]
        assert server.statistics.late == 2

    def test_a_stranger_is_not_listened_to(self, wire):
        pc = Pc()
        wire(pc, patience=0.05)
        pc.exchange(1)
        _, ipoc = pc.hear()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
            text = b'<Sen Type="elastocal"><IPOC>%d</IPOC></Sen>' % ipoc
            other.sendto(text, pc.sources[-1])
        assert b'<Delay D="1"/>' in pc.hear()[0]

    def test_only_sending_expects_no_answer(self, wire):
        pc = Pc()
        server = wire(pc, mode="measure", timeout=3)
        ipocs = [pc.hear()[1] for _ in range(30)]
        assert ipocs == list(range(IPOC_START, IPOC_START + 120, 4))
        assert server.statistics.late == 0

    def test_where_the_pc_guides_the_robot_goes(self, wire):
        pc = Pc()
        wire(pc)
        guide = b'<Stop>0</Stop><Cmd N="0" Op="1" V="10.0"/>'
        pc.exchange(10, guide)
        before = re.search(rb'RIst X="([-\d.]+)"', pc.hear()[0])
        pc.answer(int(IPOC_START + 40), guide)
        pc.exchange(10, guide + b'<RKorr X="0.010" Y="0" Z="0" A="0" B="0" C="0"/>')
        pc.exchange(5, guide)
        after = re.search(rb'RIst X="([-\d.]+)"', pc.hear()[0])
        assert float(after[1]) - float(before[1]) == pytest.approx(0.1, abs=1e-5)

    def test_an_arm_that_cannot_carry_its_load_stops_the_controller(self, wire, monkeypatch):
        def fail(_robot, _heard):
            raise EquilibriumError("too heavy")

        monkeypatch.setattr(RsiRobot, "cycle", fail)
        pc = Pc()
        server = wire(pc, operator=0.0)
        first = pc.exchange(1)[0]
        assert pc.exchange(1)[0] < first
        assert server.statistics.stops[0] == "too heavy"


class TestServer:
    """What `elastocal simulate` starts."""

    def test_it_is_what_the_cell_file_says(self):
        live = LiveCell(example_cell(simulation=QUIET), 0, SimClock())
        pc = Pc()
        settings = {
            "port": pc.port,
            "delay": 0.004,
            "cycle": 0.012,
            "timeout": 7,
            "mode": "contact",
        }
        server = rsi_server(live, Told(settings=settings | {"commissioning": None}))
        assert server.ports["udp"] == pc.port
        server.start()
        data, _ = pc.hear()
        assert b'<Krl N="0" State="0"/>' in data
        assert b'E6="0.000000"' in data
        pc.answer(IPOC_START)
        assert pc.hear()[1] == IPOC_START + 12
        server.close(), pc.socket.close()

    def test_without_a_port_it_says_where_the_pc_has_to_listen(self):
        live = LiveCell(example_cell(simulation=QUIET), 0, SimClock())
        server = rsi_server(live, Told())
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as pc:
            pc.bind(("127.0.0.1", server.ports["udp"]))
            pc.settimeout(5.0)
            server.start()
            assert pc.recv(4096).startswith(b"<Rob")
        server.close()


class TestFaults:
    @pytest.mark.parametrize(
        ("fault", "steps"),
        [("ipoc_jump", [4, 1004, 4, 4]), ("lost", [4, 8, 4, 4]), ("repeated", [4, 4, 0, 4]),
         ("swapped", [4, 8, -4, 8])],
    )  # fmt: skip
    def test_the_count_is_as_the_fault_makes_it(self, wire, fault, steps):
        pc = Pc()
        wire(pc, patience=0.2, faults=(fault,))
        assert np.diff(pc.exchange(5)).tolist() == steps

    def test_a_second_robot_sends_from_another_port(self, wire):
        pc = Pc()
        wire(pc, patience=0.2, faults=("intruder",))
        for _ in range(2):
            pc.exchange(1)
        (first, one), (second, other) = pc.hear(), pc.hear()
        assert one == other
        assert first != second
        assert len(set(pc.sources)) == 2

    def test_what_makes_no_sense_is_no_datagram_of_a_cycle(self, wire):
        pc = Pc()
        wire(pc, patience=0.1, faults=("malformed", "malformed"))
        assert pc.exchange(2)[1] > 0
        assert [pc.hear()[1] for _ in range(3)] == [-1, -1, IPOC_START + 16]

    def test_an_answer_that_the_robot_does_not_hear_is_late(self, wire):
        pc = Pc()
        server = wire(pc, patience=0.2, faults=("deaf", "deaf"))
        pc.exchange(6)
        pc.hear()
        assert (server.statistics.late, server.statistics.stops) == (2, [])

    def test_a_restart_begins_another_count(self, wire):
        pc = Pc()
        server = wire(pc, patience=0.2, faults=("restart",))
        ipocs = pc.exchange(4)
        assert ipocs[2] < ipocs[0]
        assert ipocs[3] - ipocs[2] == 4
        assert server.statistics.stops == ["restart"]
