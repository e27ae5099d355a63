"""A KUKA arm of the driver on a bench: its peer, its link without socket, its feed, one clock."""

import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from elastocal.cell import Arming, ArmState, Cell, Motion
from elastocal.drivers.kuka_rsi import CommissioningRecord, DelayEstimate, KukaArm, RsiSettings
from elastocal.drivers.kuka_rsi.link import LinkAddress, RsiLink
from support.kuka_peer import KukaPeer, PeerClock, PeerFeed
from support.simulated import Place, example_cell, places


def write_cell(folder: Path, **arm: object) -> Path:
    """Write the example cell with a KUKA on this machine; return its file."""
    cell = example_cell("afp")
    data = yaml.safe_load(cell.path.read_text())
    data["devices"] = {"arm": {"driver": "kuka_rsi", **arm}}
    for mesh in cell.path.parent.glob("*.stl"):
        shutil.copy(mesh, folder)
    if "process" in data:
        shutil.copy(cell.path.parent / data["process"]["file"], folder)
    path = folder / "kuka.yaml"
    path.write_text(yaml.safe_dump(data))
    return path


def record(cycle: float = 0.004) -> CommissioningRecord:
    """Return the record of an arm of the example cell, 25 ms."""
    bench = Bench.of()
    return CommissioningRecord(
        cell="cell",
        robot=bench.peer.robot.name,
        controller="127.0.0.1",
        made="2026-11-22T12:00:00",
        cycle=cycle,
        delay=0.025,
        amplitude=5e-4,
        chirps=(DelayEstimate(0.02, 0.005, 1.0, 0.01),),
        link=bench.link.statistics(),
    )


SETTINGS = {
    "cycle": "12 ms",
    "mode": "contact",
    "delay": "24 ms",
    "contact_stiffness": "1 MN/m",
    "largest_correction": "150 mm",
    "ptp_percent": 30,
}


@dataclass
class Bench:
    arm: KukaArm
    peer: KukaPeer
    link: RsiLink
    clock: PeerClock
    feed: PeerFeed
    place: Place

    @classmethod
    def of(cls, like: str = "afp", cell: Cell | None = None, **changed: object) -> "Bench":
        cell = example_cell(like) if cell is None else cell
        place = places(like)[0]
        settings = RsiSettings.model_validate(SETTINGS | changed)
        delay = round(settings.motion_delay(cell) / settings.cycle)
        peer = KukaPeer(cell, delay, cycle=settings.cycle)
        tip = cell.robot.forward(place.q)[:3, 3]
        peer.surface = (tip, place.normal)
        clock, feed = PeerClock(peer), PeerFeed(peer)
        arm = KukaArm(cell, settings, clock, feed)
        address = LinkAddress(
            "127.0.0.1", 0, "127.0.0.1", settings.cycle, settings.mode != "measure"
        )
        link = RsiLink(address, arm, clock, timer=lambda: 0.0)
        arm.link = clock.link = link
        arm.arming = Arming.of(cell)
        clock.sleep(0.1)
        return cls(arm, peer, link, clock, feed, place)

    def wait(self, *motions: Motion, most: float = 60.0) -> ArmState:
        begin = self.clock.now()
        while self.clock.now() - begin < most:
            state = self.arm.state()
            if state.motion in motions:
                return state
            self.clock.sleep(0.04)
        raise AssertionError(f"still {state.motion}")

    def ready(self) -> ArmState:
        """Enable, and stand at the approach pose."""
        self.arm.enable()
        self.peer.q = self.place.q_approach.copy()
        self.peer.T_programmed = self.peer.T
        self.clock.sleep(0.1)
        return self.arm.state()

    def touch(self, force: float = 50.0) -> ArmState:
        """Go to near contact and touch."""
        self.ready()
        self.arm.approach(-self.place.normal, 0.095, 0.05, np.inf)
        self.wait(Motion.IDLE)
        self.arm.approach(-self.place.normal, 0.015, 0.005, force)
        return self.wait(Motion.IDLE, Motion.STOPPED)

    @property
    def force_tcp(self) -> np.ndarray:
        """Force that the tooling really exerts on the robot."""
        return self.peer.T[:3, :3].T @ self.peer.force_base
