"""Sound campaigns of the simulated example cells, made quickly, for mistakes to be made in them."""

import re
import tempfile
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from elastocal.cell import CONDITIONING, LIGHT_CONTACT, Cell, load_cell
from elastocal.cell.examples import write_example
from elastocal.dataset import Readings
from elastocal.planning import make_plan
from elastocal.robot import Robot
from elastocal.sim.workcell import (
    CampaignErrors,
    CampaignSimulator,
    ContactPoses,
    ErrorDraws,
    ErrorScales,
)

CELLS = ("afp", "machining", "ur20")
"""Example cells; the arm of the first stands on a rail."""
PRESETS = ("kind", "typical", "harsh")
_POSES = 40
"""Poses that a plan holds; campaigns take some of them."""


@dataclass(frozen=True)
class Sound:
    """How a sound campaign is made."""

    like: str = "afp"
    preset: str = "typical"
    poses: int = 31
    seed: int = 0
    conditioned: bool = False
    """Whether the zero is read in light contact after a full press."""
    level: float = 1.0
    """Part of the loads of the cell file."""
    rail: bool = True
    """Whether the arm moves along its rail, where it has one."""

    @property
    def title(self) -> str:
        """Return what it is called in the table of mistakes."""
        return f"{self.like} {self.preset}"


@dataclass(frozen=True, eq=False)
class Made:
    """A campaign with what a user knows of it."""

    robot: Robot
    marker: np.ndarray
    """In the tcp frame, shape (3,), in m."""
    readings: Readings
    tool_weight: float
    """Weight of all that hangs on the sensor, in N."""
    sound: Sound
    """How it was made."""


class Truth(NamedTuple):
    """What the simulator knows of poses that a campaign does not hold."""

    q: np.ndarray
    """Joints under load, shape (reading, joint), in rad or m."""
    force: np.ndarray
    """Force on the robot in base, shape (reading, 3), in N."""
    deflection: np.ndarray
    """Deflection of the tool in base, shape (reading, 3), in m."""


@cache
def _folder() -> tempfile.TemporaryDirectory[str]:
    """Return where example cells are written; removed when the process ends."""
    return tempfile.TemporaryDirectory()


@cache
def cell_of(like: str, preset: str) -> Cell:
    folder = Path(_folder().name) / f"{like} {preset}"
    file, *_ = write_example(folder, like)
    text = file.read_text(encoding="utf-8").replace("pool: 3000", "pool: 120")
    text = re.sub(r"(?m)^  d_max:.*\n  # poses: \d+.*$", "  # poses: 31", text)
    text = re.sub(r"(?m)^  (# )?poses: \d+.*$", f"  poses: {_POSES}", text)
    text = text.replace("preset: typical", f"preset: {preset}")
    file.write_text(text, encoding="utf-8")
    return load_cell(file)


@cache
def _places(like: str) -> tuple[ContactPoses, np.ndarray]:
    """Return planned poses, and where the tracker that sees each stands; presets share them."""
    cell = cell_of(like, "typical")
    poses = make_plan(cell, None, jobs=1).plan.poses
    stations = {each.name: each.position_base for each in cell.file.trackers}
    places = ContactPoses(np.array([p.joints for p in poses]), np.array([p.normal for p in poses]))
    return places, np.array([stations[p.seen_by] for p in poses])


@cache
def campaign(sound: Sound) -> Made:
    """Return a sound campaign; the arm, its errors and the poses differ from seed to seed."""
    cell = cell_of(sound.like, sound.preset)
    rng = np.random.default_rng([sound.seed, 7])
    (q, normal), stations = _places(sound.like)
    chosen = _chosen(sound, rng)
    presses = dict(cell.file.presses)
    presses.pop(cell.file.load_cases.check_case, None)
    names, force = list(presses), list(sound.level * np.array(list(presses.values())))
    reference = None
    if sound.conditioned:
        names = [CONDITIONING, LIGHT_CONTACT, *names]
        full = max(force, key=lambda each: float(np.linalg.norm(each)))
        light = np.array([0.0, 0.0, -60.0 if full[2] < -300.0 else -10.0])
        force = [1.05 * full, light, *force]
        reference = 1
    truth = _arm(sound, rng)
    places = ContactPoses(q[chosen], normal[chosen])
    settled = truth.settle(places, np.array(force), seed=sound.seed, reference=reference)
    cases = tuple(name for name in names if name != LIGHT_CONTACT)
    draws = ErrorDraws.of(len(chosen), len(cases), rng)
    readings = CampaignErrors.of(cell).readings(
        settled, draws, ErrorScales(), stations[chosen], cases, conditioned=sound.conditioned
    )
    here = cell.robot.forward(readings.reference_joint_position)[:, :3, 3]
    readings = replace(readings, tcp_position=here)
    assert cell.file.tool is not None
    assert cell.file.marker is not None
    weight = 9.81 * float(cell.file.tool.mass)
    return Made(cell.robot, np.array(cell.file.marker.position_tcp), readings, weight, sound)


def _chosen(sound: Sound, rng: np.random.Generator) -> np.ndarray:
    """Return which of the planned poses a campaign holds."""
    q = _places(sound.like)[0].q
    chosen = rng.choice(len(q), min(sound.poses, len(q)), replace=False)
    if cell_of(sound.like, sound.preset).robot.external_axes and not sound.rail:
        near = np.argsort(np.abs(q[:, 0] - np.median(q[:, 0])), kind="stable")
        chosen = near[: min(sound.poses, len(q))]
    return np.sort(chosen)


def _arm(sound: Sound, rng: np.random.Generator) -> CampaignSimulator:
    """Return the truth of a cell, with springs that differ from arm to arm."""
    truth = CampaignSimulator.of(cell_of(sound.like, sound.preset))
    return truth.stiffened(np.exp(rng.normal(0.0, 0.15, truth.springs)))


@cache
def unseen(sound: Sound) -> Truth:
    """Return the truth at planned poses that a campaign does not hold, at most ten."""
    cell, rng = cell_of(sound.like, sound.preset), np.random.default_rng([sound.seed, 7])
    (q, normal), _ = _places(sound.like)
    left = np.setdiff1d(np.arange(len(q)), _chosen(sound, rng))[:10]
    presses = dict(cell.file.presses)
    presses.pop(cell.file.load_cases.check_case, None)
    force = np.array(list(presses.values()))
    places = ContactPoses(q[left], normal[left])
    found = _arm(sound, rng).settle(places, force, seed=sound.seed)
    n = found.q.shape[-1]
    return Truth(
        found.q.reshape(-1, n), found.force.reshape(-1, 3), found.deflection.reshape(-1, 3)
    )


def sounds(count: int, seed: int = 0) -> list[Sound]:
    """Return ways of making sound campaigns that go through all cells, presets and sizes."""
    rng = np.random.default_rng(seed)
    found = []
    for number in range(count):
        found.append(
            Sound(
                like=CELLS[number % len(CELLS)],
                preset=PRESETS[number // len(CELLS) % len(PRESETS)],
                poses=int(rng.integers(8, 32)),
                seed=seed + number,
                conditioned=bool(rng.integers(2)),
                level=float(rng.choice([0.5, 1.0, 1.0])),
                rail=bool(rng.integers(2)),
            )
        )
    return found
