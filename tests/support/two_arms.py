"""A cell of two robots, taken through plan, simulated campaign and calibration."""

from importlib.resources import files
from pathlib import Path

import numpy as np

from elastocal import workflows
from elastocal.robot.inverse import inverse_for, joints_along_path
from elastocal.two_robots import PairCell, load_pair_cell
from elastocal.two_robots.meetings import meeting_pool
from support import kept

CELL = (files("elastocal.two_robots") / "example.yaml").read_text(encoding="utf-8")


def cell(folder: Path, text: str = CELL, name: str = "cell.yaml") -> PairCell:
    """Write a cell file, and return its cell."""
    (folder / name).write_text(text, encoding="utf-8")
    return load_pair_cell(folder / name)


def finished() -> Path:
    """Return a folder with ``cell.yaml``, ``plan.json``, ``run``, ``models`` and two paths."""
    return kept.kept("two-arms", _make)


def _make(folder: Path) -> None:
    made = cell(folder)
    file = folder / "cell.yaml"
    workflows.plan_pair(file, out=folder / "plan.json", language="de")
    workflows.simulate_pair(file, plan=folder / "plan.json", out=folder / "run")
    own = folder / "run" / "left.nc", folder / "run" / "right.nc"
    workflows.calibrate_pair(file, *own, out=folder / "models", draws=60, language="de")
    write_paths(folder, made)


def write_paths(folder: Path, made: PairCell, rows: int = 15) -> None:
    """Write the paths of a process: both tools move sideways by 0.2 m and press on each other."""
    pool = meeting_pool(made, np.random.default_rng(7))
    T, q, R = pool.T[0], (pool.q[0][0], pool.q[1][0]), made.T_first_second[:3, :3]
    shift = np.linspace(0.0, 0.1, rows)[:, None] * [0.0, 0.0, -1.0]
    force = np.outer(np.linspace(300.0, 900.0, rows), -T[:3, 2])
    own = (shift, force), (shift @ R, -force @ R)
    for name, robot, start, (moved, load) in zip(made.arms, made.robots, q, own, strict=True):
        poses = np.tile(robot.forward(start), (rows, 1, 1))
        poses[:, :3, 3] += moved
        joints = joints_along_path(inverse_for(robot), poses, np.zeros((rows, 0)), start, str)
        heads = [f"{joint}[rad]" for joint in robot.joint_names]
        heads += [f"force_{axis}[N]" for axis in "xyz"]
        np.savetxt(
            folder / f"{name}_path.csv",
            np.hstack([joints, load]),
            delimiter=",",
            header=",".join(heads),
            comments="",
        )
