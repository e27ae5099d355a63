"""Print how fast the compensator is: the exported C beside Pinocchio, and the Python step.

Machines differ and are noisy, so the ratios count, taken in the same run: to Pinocchio's own
Jacobian of the same 18-spring model, and of the richest model (gears of two knees and four
friction elements at every joint, under the arm's own weight) to that one. Needs gcc.
Run with ``python benchmarks/compensation.py``.
"""

import shutil
import subprocess
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
from timing import figure, inside

from elastocal.compensation import CompensatorSettings
from elastocal.compensation.export import write_c
from elastocal.compensation.online import Compensator, Design, Reading, design
from elastocal.elastic import ElasticModel, Gear, layout
from elastocal.identification import CalibratedModel, Observability
from elastocal.robot import ChainModel, InsertedJoint, Robot, build_model, catalogue, with_tool

HARNESS = Path(__file__).parents[1] / "tests" / "support" / "export_harness.c"
TOOL = np.array([[0.0, 0, 1, 0.15], [0, 1, 0, 0], [-1, 0, 0, 0.35], [0, 0, 0, 1]])
ROWS, REPEATS = 1000, 5
KNEES, SLIPS = (500.0, 2000.0), (150.0, 300.0, 600.0, 1500.0)
SETTINGS = CompensatorSettings(
    filter={
        "median": 3,
        "notches": [{"frequency": "50 Hz", "width": "10 Hz"}],
        "low_pass": {"cutoff": "15 Hz", "order": 2},
    }
)


def calibrated(gears: bool = False) -> CalibratedModel:
    """Return an 18-spring KUKA arm with made-up compliances and 200 draws."""
    urdf = with_tool(catalogue.urdf("KR 120 R2700 extra HA"), "flange", "tcp", TOOL)
    robot = Robot.from_urdf(urdf, "tcp")
    springs = layout(robot, "links" if gears else "bearing")
    if gears:
        axial, virtual = springs[: len(robot.joint_names)], springs[len(robot.joint_names) :]
        places = ((s.name, s.joint, s.axes[0].axis) for s in axial)
        geared = (Gear(*place, knees=KNEES, slips=SLIPS, plays=True) for place in places)
        springs = (*geared, *virtual)
    model = ElasticModel(robot, springs)
    rng, n = np.random.default_rng(0), len(model.parameters)
    compliance = rng.uniform(1e-7, 1e-6, n)
    draws = compliance * (1.0 + 0.1 * rng.normal(size=(200, n)))
    return CalibratedModel(model, compliance, draws, Observability(n, 1.0, (True,) * n, ()))


def rows(model: ElasticModel) -> np.ndarray:
    """Return joints, forces and moments."""
    rng, limits = np.random.default_rng(1), model.robot.limits
    q = rng.uniform(limits.lower, limits.upper, (ROWS, len(limits.lower)))
    return np.hstack([q, 500.0 * rng.normal(size=(ROWS, 3)), 50.0 * rng.normal(size=(ROWS, 3))])


def c_seconds(numbers: Design, data: np.ndarray) -> tuple[float, float]:
    """Return seconds a call of the exported deflection and step, compiled with -O2."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "c"
        write_c(folder, numbers)
        program = folder / "timing"
        sources = [str(folder / "elastocal_model.c"), str(HARNESS), f"-I{folder}"]
        subprocess.run(["gcc", "-std=c99", "-O2", *sources, "-o", program, "-lm"], check=True)
        runs = [
            subprocess.run(
                [program, "timing"], input=data.tobytes(), capture_output=True, check=True
            )
            for _ in range(REPEATS)
        ]
    times = np.array([run.stdout.split()[:2] for run in runs], dtype=float)
    deflection, step = np.median(times, axis=0)
    return float(deflection), float(step)


def pinocchio_seconds(model: ElasticModel, data: np.ndarray) -> tuple[float, float]:
    """Return seconds a call of Pinocchio's Jacobian with all 18 springs as joints.

    The second number is the same without what a call on a chain of one joint takes: nearly all of
    that is Python's, not Pinocchio's.
    """
    robot, joints = model.robot, len(model.robot.joint_names)
    names = robot.joint_names
    places = [(s.name, names.index(s.joint), s.axes[0]) for s in model.springs[joints:]]
    inserted = [
        InsertedJoint(name, at, np.array(s.axis), s.revolute, s.distal, np.array(s.offset))
        for name, at, s in places
    ]
    whole = jacobian_seconds(build_model(robot.chain, inserted), data[:, :joints])
    single = replace(robot.chain, joints=robot.chain.joints[:1])
    return whole, whole - jacobian_seconds(build_model(single), data[:, :1])


def jacobian_seconds(chain: ChainModel, joints: np.ndarray) -> float:
    """Return the median over some rounds of the mean time of a Jacobian."""
    workspace, frame = chain.model.createData(), chain.tip_frame
    axes, jacobian = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED, pin.computeFrameJacobian
    configurations = np.zeros((len(joints), chain.model.nq))
    configurations[:, chain.joint_columns] = joints
    means = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        for q in configurations:
            jacobian(chain.model, workspace, q, frame, axes)
        means.append((time.perf_counter() - start) / len(joints))
    return float(np.median(means))


def python_seconds(numbers: Design, data: np.ndarray) -> np.ndarray:
    """Return seconds of each Python step."""
    return stepped(Compensator(numbers), data)


def stepped(compensator: Compensator, data: np.ndarray) -> np.ndarray:
    """Return seconds of each step of a compensator."""
    taken, state = [], compensator.start()
    n = data.shape[1] - 6
    for k, row in enumerate(data.tolist()):
        reading = Reading(0.004 * k, row[:n], row[n : n + 3], row[n + 3 :])
        start = time.perf_counter()
        state, _ = compensator.step(state, reading)
        taken.append(time.perf_counter() - start)
    return np.array(taken)


def loop_quantile(median: float, quantile: float) -> float:
    """Return a quantile of the times of a bare loop that takes that long at the median, in s.

    What else the machine does meets the loop as it meets a step.
    """

    def taken(turns: int, times: int) -> np.ndarray:
        found = []
        for _ in range(times):
            start = time.perf_counter()
            for _ in range(turns):
                pass
            found.append(time.perf_counter() - start)
        return np.array(found)

    turns = round(1000 * median / float(np.median(taken(1000, ROWS))))
    return float(np.quantile(taken(turns, 3 * ROWS), quantile))


def part_seconds(numbers: Design, data: np.ndarray) -> dict[str, float]:
    """Return what a Python step spends in its parts, in s."""
    compensator = Compensator(numbers)
    owners = {
        "the generated function of the model": (compensator, "_block"),
        "filters and weight, in Python": (compensator._conditioner, "step"),
    }
    return {
        part: inside(lambda: stepped(compensator, data), *owner) / len(data)
        for part, owner in owners.items()
    }


def side_by_side(
    models: Sequence[CalibratedModel], data: np.ndarray
) -> tuple[list[Design], list[tuple[float, float]]]:
    """Return the designs of models, and median and 99th percentile of their Python steps in us."""
    designs = [design(each, SETTINGS) for each in models]
    long = np.tile(data, (3, 1))
    taken = [np.quantile(python_seconds(each, long), [0.5, 0.99]) for each in designs]
    return designs, [(float(1e6 * each[0]), float(1e6 * each[1])) for each in taken]


def c_microseconds(designs: Sequence[Design], data: np.ndarray) -> list[np.ndarray] | None:
    """Return the times of the exported deflections and steps in us; None, said, without gcc."""
    if shutil.which("gcc") is None:
        print("no gcc: the C is not timed")
        return None
    return [1e6 * np.array(c_seconds(each, data)) for each in designs]


def main() -> None:
    """Measure and print."""
    model, rich = calibrated(), calibrated(gears=True)
    data = rows(model.model)
    designs, usual = side_by_side((model, rich), data)
    plain, geared = (median for median, _ in usual)
    step = ("18 springs", 1e-6 * plain)
    called, own = (1e6 * each for each in pinocchio_seconds(model.model, data))
    jacobian = ("Pinocchio's Jacobian of the same springs, from Python", 1e-6 * called)
    figure("Python step, 18 springs, filters and interval", 1e-6 * plain, jacobian, aim=20e-6)
    figure("Python step, gears, weight, friction", 1e-6 * geared, step, aim=35e-6)
    names = "18 springs, filters and interval", "gears, weight, friction"
    for name, numbers, (each, seldom) in zip(names, designs, usual, strict=True):
        loop = ("a bare loop of the same median", loop_quantile(1e-6 * each, 0.99))
        figure(f"Python step, {name}: 99 of 100 within", 1e-6 * seldom, loop, aim=2e-6 * each)
        for part, spent in part_seconds(numbers, data).items():
            figure(f"Python step, {name}: {part}", spent, ("the whole step", 1e-6 * each))
    timed = c_microseconds(designs, data)
    if timed is None:
        return
    (deflection, stepped), (richer, further) = timed
    bare = ("Pinocchio's Jacobian of the same springs, without the call", 1e-6 * own)
    figure("C deflection, 18 springs", 1e-6 * deflection, bare)
    figure("C step with filters and interval", 1e-6 * stepped, bare)
    figure(
        "C deflection, gears, weight, friction", 1e-6 * richer, ("18 springs", 1e-6 * deflection)
    )
    figure("C step with them", 1e-6 * further, ("18 springs", 1e-6 * stepped))


if __name__ == "__main__":
    main()
