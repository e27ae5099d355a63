"""Print the figures of docs/explanation/performance.md, each beside a reference of the same run.

Times are medians over repetitions; machines differ and are noisy, so the ratios are what counts.
Run with ``make bench``.
"""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.optimize import lsq_linear
from timing import figure, seconds

from elastocal.elastic import ElasticModel, layout
from elastocal.identification import Problem, build, calibrate, solve
from elastocal.robot import Robot, catalogue, with_tool
from elastocal.sim.arm import (
    SHOP_FLOOR,
    Linkage,
    bearing_truth,
    measure,
    press_forces,
    press_poses,
)

TOOL = np.array([[1.0, 0, 0, 0.15], [0, 1.0, 0, 0], [0, 0, 1.0, 0.35], [0, 0, 0, 1.0]])


def median_ms(work: Callable[[], object], repetitions: int) -> float:
    """Return the median time of a call in ms, after one call that is not counted."""
    return 1e3 * seconds(work, repetitions)


def full_system(problem: Problem) -> None:
    """Solve the bounded problem the direct way."""
    lsq_linear(problem.O.reshape(-1, problem.columns), problem.d.ravel(), (0.0, np.inf))


def command_ms(*command: str) -> float:
    """Return the median time of a process in ms."""
    return median_ms(lambda: subprocess.run(command, check=True, capture_output=True), 7)


def main() -> None:
    """Measure and print."""
    urdf = with_tool(catalogue.urdf("KR 120 R2700 extra HA"), "flange", "tcp", TOOL)
    robot = Robot.from_urdf(urdf, "tcp")
    linkage = Linkage.from_urdf(urdf, "tcp")
    rng = np.random.default_rng(0)
    pressed = press_poses(linkage, 31, rng)
    forces = press_forces(pressed.T_base_tcp)
    data = measure(bearing_truth(linkage), pressed.joints, forces, SHOP_FLOOR, rng)
    readings = data.readings(robot.joint_names)
    model = ElasticModel(robot, layout(robot, "bearing"))
    problem = build(model, readings)

    fit, reference = (
        median_ms(lambda: solve(problem), 50),
        median_ms(lambda: full_system(problem), 20),
    )
    full = ("scipy.optimize.lsq_linear on the full system", 1e-3 * reference)
    figure("one bounded fit: 18 springs, 31 poses × 5 load cases", 1e-3 * fit, full)

    whole = median_ms(lambda: calibrate(model, readings, np.random.default_rng(0)), 20)
    figure("`calibrate` with 200 bootstrap draws, same data", 1e-3 * whole, full)

    q = rng.uniform(-1.0, 1.0, (3000, 1, 6))
    force = rng.uniform(-1e3, 1e3, (3000, 5, 3))
    each = np.broadcast_to(q, (3000, 5, 6))
    shared_ms = median_ms(lambda: model.observation_blocks(q, force), 20)
    each_ms = median_ms(lambda: model.observation_blocks(each, force), 20)
    rigid_ms = median_ms(lambda: robot.jacobian(each), 20)
    rigid = ("the rigid robot's 6-joint Jacobians, a reading each", 1e-3 * rigid_ms)
    figure("observation blocks, 3000 poses × 5 loads, joints once a pose", 1e-3 * shared_ms, rigid)
    figure("the same, joints given for every reading", 1e-3 * each_ms, rigid)

    python = command_ms(sys.executable, "-c", "pass")
    shown = command_ms(str(Path(sys.executable).parent / "elastocal"), "--help")
    empty = ("an empty Python process", 1e-3 * python)
    figure("`elastocal --help`", 1e-3 * shown, empty, aim=0.3)


if __name__ == "__main__":
    main()
