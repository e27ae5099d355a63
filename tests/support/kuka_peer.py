"""A KUKA controller in a hundred lines, for the tests of its driver: no sockets, no threads.

It shares nothing with the driver: it reads ``<Sen>`` by regular expressions and has its own words
for the channels. Time passes when the tests sleep by `PeerClock`: then datagrams go to and fro.
"""

import re
from collections import deque
from dataclasses import dataclass, field

import numpy as np

from elastocal.cell import Cell, SensorStatus, WrenchSample
from elastocal.robot import xyzabc_from_T

NUMBER = re.compile(r'(\w+)="([-0-9.]+)"')


def element(text: str, tag: str) -> dict[str, float]:
    found = re.search(rf"<{tag} ([^>]*)/>", text)
    return {} if found is None else {k: float(v) for k, v in NUMBER.findall(found[1])}


@dataclass
class KukaPeer:
    """Arm, program and contact; the arm is where its axes are."""

    cell: Cell
    delay: int = 3
    """Cycles from a correction to its motion."""
    poscorr: float = 0.2
    """Along each axis, in m."""
    stiffness: float = 1e6
    lateral: float = 5e5
    friction: float = 0.6
    surface: tuple[np.ndarray, np.ndarray] | None = None
    """A point of the tooling, and its normal."""
    noise: float = 0.0
    speed: float = 1.0
    """Fastest change of a joint, in rad/s or m/s at 100 percent."""
    cycle: float = 0.004
    ipoc: int = 1000
    state: int = 1
    number: int = 0
    q: np.ndarray = field(init=False)
    fault: set[str] = field(default_factory=set)
    """``deaf``: takes no orders; ``brakes``: gives moves up; ``rides``: takes no move back."""
    answers: list[str] = field(default_factory=list)
    bias: np.ndarray = field(default_factory=lambda: np.array([12.0, -7.0, 3.0]))
    knock: np.ndarray = field(default_factory=lambda: np.zeros(3))
    """Force on the robot from somewhere, base."""
    knows_adopt: bool = True
    """Whether its program takes the present place for the programmed one."""
    slips: float = 0.0
    """How far the first axis of the arm turns meanwhile, in rad."""
    off: float = 0.5
    """How long it is silent then, in s."""
    silent: int = 0
    """Cycles without a message from now on."""

    def __post_init__(self):
        self.robot, self.q = self.cell.robot, self.cell.home.copy()
        self._known: tuple[bytes, np.ndarray] = (b"", np.eye(4))
        self.offset, self.queue = np.zeros(3), deque([np.zeros(3)] * self.delay)
        self.T_programmed = self.T
        self.time, self.stick, self.dropped = 0.0, None, 0
        self.rng = np.random.default_rng(0)

    @property
    def T(self) -> np.ndarray:
        """Tool frame at the present joints."""
        key = self.q.tobytes()
        if self._known[0] != key:
            self._known = (key, self.robot.forward(self.q))
        return self._known[1].copy()

    def rob(self) -> bytes:
        def attributes(names, values):
            return " ".join(f'{n}="{v:.6f}"' for n, v in zip(names, values, strict=True))

        def frame(tag, T):
            values = xyzabc_from_T(T)
            return (
                f"<{tag} {attributes('XYZABC', [*(1e3 * values[:3]), *np.degrees(values[3:])])}/>"
            )

        external = self.robot.external_axes
        scale = [180.0 / np.pi if turns else 1e3 for turns in self.robot.revolute[:external]]
        e = [*(self.q[:external] * scale), *[0.0] * (6 - external)]
        arm = attributes([f"A{i}" for i in range(1, 7)], np.degrees(self.q[external:]))
        rail = attributes([f"E{i}" for i in range(1, 7)], e)
        parts = [
            frame("RIst", self.T),
            frame("RSol", self.T_programmed),
            f'<AIPos {arm}/><EIPos {rail}/><Delay D="0"/>',
            f'<Krl N="{self.number}" State="{self.state}"/><IPOC>{self.ipoc}</IPOC>',
        ]
        return f'<Rob Type="KUKA">{"".join(parts)}</Rob>'.encode()

    def take(self, sen: bytes | None) -> None:
        """Carry out one cycle with an answer; None: it was lost."""
        self.ipoc += round(1e3 * self.cycle)
        if sen is None:
            self.dropped += 1
            self._move(np.zeros(3))
            return
        text = sen.decode()
        self.answers.append(text)
        assert f"<IPOC>{self.ipoc - round(1e3 * self.cycle)}</IPOC>" in text
        korr = element(text, "RKorr")
        wanted = 1e-3 * np.array([korr[k] for k in "XYZ"])
        order = int(element(text, "Cmd")["Op"]) if "<Cmd" in text else 1
        self._obey(order, text)
        self._move(wanted if self.state == 2 else np.zeros(3))

    def _obey(self, order, text):
        if "deaf" in self.fault:
            return
        command = element(text, "Cmd")
        if self.state == 3 and order != 3:
            self._ride(order)
        elif order == 1:
            assert "<Stop>0</Stop>" in text
            self.state = 2
        elif order == 2 and int(command["N"]) != self.number:
            external = self.robot.external_axes
            scale = np.array([np.pi / 180 if t else 1e-3 for t in self.robot.revolute])
            axes, rail = element(text, "Ax"), element(text, "Ex")
            given = [rail[f"E{i}"] for i in range(1, external + 1)]
            self.target = np.array([*given, *(axes[f"A{i}"] for i in range(1, 7))]) * scale
            self.percent, self.state, self.next = command["V"], 3, int(command["N"])
        elif order == 3 and self.knows_adopt and int(command["N"]) != self.number:
            assert "<Stop>1</Stop>" in text
            if self.state == 1:
                self.state, self.silent = 1, round(self.off / self.cycle)
                self.number = int(command["N"])
                self.q = self.q.copy()
                self.q[self.robot.external_axes] += self.slips
                self.restart()
                self.ipoc += 1_000_000
            self.state = 1
        elif order in (0, 3):
            assert "<Stop>1</Stop>" in text
            self.state = 1

    def restart(self) -> None:
        """Take the place where the arm stands for the programmed one, as a started program does."""
        self.offset, self.queue = np.zeros(3), deque([np.zeros(3)] * self.delay)
        self.T_programmed = self.T

    def _ride(self, order):
        way = self.target - self.q
        most = 0.01 * self.percent * self.speed * self.cycle
        done = float(np.abs(way).max()) <= most
        braked = (order != 2 and "rides" not in self.fault) or "brakes" in self.fault
        if not braked:
            self.q = self.target if done else self.q + way * (most / np.abs(way).max())
        self.T_programmed = self.T
        self.T_programmed[:3, 3] -= self.offset
        if done or braked:
            self.state, self.number = (5 if braked else 4), self.next

    def _move(self, wanted):
        self.queue.append(wanted)
        shift = self.queue.popleft()
        before = self.offset
        self.offset = np.clip(self.offset + shift, -self.poscorr, self.poscorr)
        if np.any(self.offset != before):
            goal = self.T_programmed[:3, 3] + self.offset
            for _ in range(2):
                J = self.robot.jacobian(self.q)
                arm = slice(self.robot.external_axes, None)
                J6 = np.vstack([J.translation[:, arm], J.rotation[:, arm]])
                T = self.T
                turn = self.T_programmed[:3, :3] @ T[:3, :3].T
                small = 0.5 * np.array(
                    [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
                )
                dx = np.concatenate([goal - T[:3, 3], small])
                self.q = self.q.copy()
                self.q[arm] += np.linalg.solve(J6, dx)

    @property
    def force_base(self) -> np.ndarray:
        """Force of the contact on the robot, base, in N."""
        if self.surface is None:
            return self.knock
        point, normal = self.surface
        at = self.T[:3, 3]
        depth = float((point - at) @ normal)
        if depth <= 0.0:
            self.stick = None
            return self.knock
        if self.stick is None:
            self.stick = at
        press = self.stiffness * depth
        aside = (at - self.stick) - ((at - self.stick) @ normal) * normal
        drag, most = -self.lateral * aside, self.friction * press
        size = float(np.linalg.norm(drag))
        if size > most:
            drag *= most / size
            self.stick = at + drag / self.lateral
        return press * normal + drag + self.knock


@dataclass
class PeerFeed:
    """The wrench of the peer's sensor, as measured."""

    peer: KukaPeer
    silent: bool = False
    status: SensorStatus = SensorStatus.OK
    fails: Exception | None = None
    scale: float = 1.0
    """What the sensor states over what presses: of another unit."""
    _last: WrenchSample | None = None

    def newest(self) -> WrenchSample | None:
        peer, cell = self.peer, self.peer.cell
        if self.fails is not None:
            raise self.fails
        if self.silent:
            return self._last
        T_base_sensor = peer.T @ np.linalg.inv(cell.T_sensor_tcp)
        weight = cell.file.tool.mass * cell.gravity_base
        force = T_base_sensor[:3, :3].T @ (peer.force_base + weight) + peer.bias
        force = self.scale * (force + peer.noise * peer.rng.standard_normal(3))
        self._last = WrenchSample(peer.time, force, np.zeros(3), self.status)
        return self._last


@dataclass
class PeerClock:
    """Time that passes in `sleep`, datagram by datagram."""

    peer: KukaPeer
    link: object = None
    time: float = 5.0
    lose: int = 0
    """Answers that are lost from now on."""
    quiet: bool = False
    """The controller sends nothing."""
    _next: float = 5.0

    def now(self) -> float:
        return self.time

    def sleep(self, seconds: float) -> None:
        end = self.time + seconds
        while self._next <= end:
            self.time = self.peer.time = self._next
            self._next += self.peer.cycle
            if self.peer.silent:
                self.peer.silent -= 1
                continue
            if self.link is None or self.quiet:
                continue
            answer = self.link.answer(self.peer.rob(), ("127.0.0.1", 50_000))
            if self.lose:
                self.lose, answer = self.lose - 1, None
            self.peer.take(answer)
        self.time = self.peer.time = end
