"""Simulated cells for tests: the examples, poses on them, and a procedure in ten lines."""

import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import yaml

from elastocal.cell import Cell, load_cell
from elastocal.cell.devices import ArmState, Devices, Motion
from elastocal.cell.examples import write_example
from elastocal.planning import cell_surface
from elastocal.planning.surface import contact_frames, sample_uniform
from elastocal.robot.inverse import inverse_for
from elastocal.sim.workcell import SimulatedCell

CYCLE = 0.04
QUIET = {
    "sensor": {"force_noise": "0 N", "moment_noise": "0 N*m", "drift": "0 N", "cross_talk": 0.0},
    "tracker": {"noise": "0 um", "noise_per_metre": "0 um"},
    "controller": {"ripple": "0 N", "repeatability": "0 um"},
    "contact": {"micro_slip": "0 um"},
}
"""A section ``simulation`` of devices without noise."""


@cache
def _example(like: str) -> tuple[tempfile.TemporaryDirectory[str], dict[str, object]]:
    """Return an example in a folder that goes when the process ends, and what its file says.

    A killed process leaves the folder.
    """
    folder = tempfile.TemporaryDirectory(prefix=f"elastocal_{like}_")
    write_example(Path(folder.name), like)
    return folder, yaml.safe_load((Path(folder.name) / "cell.yaml").read_text())


def example_cell(like: str = "afp", **sections: object) -> Cell:
    """Return an example cell with some sections of its file put in.

    Its truth is the preset `kind` unless the section says otherwise: most tests that look into a
    simulated cell test the numerics of something, not how hard the truth is.
    """
    simulation = sections.get("simulation", {})
    if isinstance(simulation, dict):
        sections = sections | {"simulation": {"preset": "kind"} | simulation}
    folder, said = _example(like)
    path = Path(folder.name) / f"changed_{abs(hash(repr(sections)))}.yaml"
    path.write_text(yaml.dump(said | sections, Dumper=yaml.CSafeDumper))
    return load_cell(path)


@dataclass(frozen=True)
class Place:
    """Somewhere to press."""

    q: np.ndarray
    q_approach: np.ndarray
    normal: np.ndarray


@cache
def places(like: str = "afp", count: int = 4) -> tuple[Place, ...]:
    """Return places on the surface of an example, each with the posture nearest to HOME."""
    cell = example_cell(like)
    points = sample_uniform(cell_surface(cell), 40, np.random.default_rng(3))
    frames = contact_frames(points.position, points.normal, np.linspace(0, 6, 6, endpoint=False))
    off = frames.copy()
    off[..., :3, 3] += cell.file.engagement.approach_distance * points.normal[:, None]
    solver, external = inverse_for(cell.robot), tuple(cell.external_positions.mean(axis=0))
    found = (solver.solve_many(T.reshape(-1, 4, 4), external).q for T in (frames, off))
    q, there = (each.reshape(len(frames), -1, each.shape[-1]) for each in found)
    cost = np.abs(q - cell.home).max(axis=2)
    margin = np.minimum(cell.robot.limits.margin(q), cell.robot.limits.margin(there)).min(axis=2)
    fits = (margin > 0.1) & (np.abs(q[..., -2]) > 0.3) & np.isfinite(cost)
    cost = np.where(fits, cost, np.inf)
    best = cost.argmin(axis=1)
    rows = np.flatnonzero(np.isfinite(cost.min(axis=1)))[:count]
    assert len(rows) == count
    return tuple(Place(q[i, best[i]], there[i, best[i]], points.normal[i]) for i in rows)


@dataclass
class Session:
    """Somebody who drives the devices."""

    sim: SimulatedCell

    @classmethod
    def of(cls, cell: Cell, seed: int = 0, start: float = 0.0) -> "Session":
        session = cls(SimulatedCell.of(cell, seed, start))
        session.arm.enable()
        return session

    @property
    def devices(self) -> Devices:
        return self.sim.devices

    @property
    def arm(self):
        return self.sim.devices.arm

    @property
    def clock(self):
        return self.sim.devices.clock

    def wait(self, *motions: Motion) -> ArmState:
        """Let time pass until the arm does one of these."""
        for _ in range(4000):
            state = self.arm.state()
            if state.motion in motions:
                return state
            self.clock.sleep(CYCLE)
        raise AssertionError(f"still {state.motion}")

    def near(self, place: Place) -> ArmState:
        """Go to near contact."""
        engagement = self.sim.plant.cell.file.engagement
        self.arm.move_joints(place.q_approach, 1.0)
        self.wait(Motion.IDLE)
        way = engagement.approach_distance - engagement.near_contact
        self.arm.approach(-place.normal, way, 0.1, 60.0)
        return self.wait(Motion.IDLE, Motion.STOPPED)

    def touch(self, place: Place) -> ArmState:
        """Go from near contact to the surface."""
        self.arm.approach(-place.normal, 0.012, 0.005, 60.0)
        return self.wait(Motion.IDLE, Motion.STOPPED)

    def hold(self, force_tcp, seconds: float = 5.0) -> ArmState:
        self.arm.hold(np.array(force_tcp, dtype=float), 1000.0)
        self.clock.sleep(seconds)
        return self.arm.state()

    def leave(self, place: Place) -> ArmState:
        """Release and retract."""
        self.arm.release(2000.0)
        self.wait(Motion.IDLE)
        self.arm.retract(place.normal, 0.05, 0.1)
        return self.wait(Motion.IDLE)

    def average(self, seconds: float = 1.0):
        """Return mean force and moment, and mean marker in base, over some time."""
        sensor, tracker = self.devices.sensor, self.devices.metrology
        sensor.read(), tracker.read()
        self.clock.sleep(seconds)
        wrench, points = sensor.read(), tracker.read()
        T = self.sim.tracker.T_base_station(points.station)
        marker = points.position @ T[:3, :3].T + T[:3, 3]
        return np.concatenate([wrench.force, wrench.moment], axis=1).mean(0), marker.mean(0)


def marker_by_controller(state: ArmState, cell: Cell) -> np.ndarray:
    """Return where the controller believes the marker to be, in base."""
    T = state.T_base_tcp
    return T[:3, :3] @ cell.file.marker.position_tcp + T[:3, 3]
