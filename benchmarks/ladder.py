"""Print what the richest models cost: the whole ladder, and their step on a controller.

Choosing among all rungs and calibrating with 200 draws stands beside the calibration of 18 springs
of the same run; the C of the last rung, gears with friction memory, beside that of 18 springs.
Machines differ and are noisy, so the ratios are what counts; calibrations are timed by the least
processor time of several. Needs gcc; instructions are counted by
valgrind, where it is. Run with ``python benchmarks/ladder.py``.
"""

import re
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from record import processor_seconds
from timing import figure

from compensation import HARNESS, TOOL, c_microseconds, rows, side_by_side
from elastocal.compensation.export import write_c
from elastocal.compensation.online import Design
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.identification import RUNGS, Calibration, FitOptions, calibrate, choose_model
from elastocal.identification.mistakes.undoing import find_undone
from elastocal.robot import Robot, catalogue, with_tool
from elastocal.sim.arm import (
    LOAD_CASES,
    SHOP_FLOOR,
    Linkage,
    bearing_truth,
    measure,
    press_forces,
    press_poses,
)
from elastocal.sim.arm.elastic_arm import GRAVITY

POSES, COUNTED = 31, 40


def measured() -> tuple[Robot, Readings]:
    """Return an arm with masses, and its readings under five load cases and one of low load."""
    urdf = with_tool(catalogue.urdf("KR 120 R2700 extra HA"), "flange", "tcp", TOOL)
    robot, linkage = Robot.from_urdf(urdf, "tcp"), Linkage.from_urdf(urdf, "tcp")
    rng = np.random.default_rng(0)
    pressed = press_poses(linkage, POSES, rng)
    full = press_forces(pressed.T_base_tcp)
    force = np.concatenate([full, 0.45 * full[:, :1]], axis=1)
    arm, cases = bearing_truth(linkage, gravity=GRAVITY), (*LOAD_CASES, "low")
    data = measure(arm, pressed.joints, force, SHOP_FLOOR, rng, load_cases=cases)
    return robot, data.readings(robot.joint_names)


def single(robot: Robot, readings: Readings, springs: str = "bearing") -> Calibration:
    """Calibrate one model of the ladder."""
    model = ElasticModel(robot, RUNGS[springs].springs(robot, readings))
    return calibrate(model, readings, np.random.default_rng(0))


def whole(robot: Robot, readings: Readings, springs: str) -> Calibration:
    """Choose among the rungs, and calibrate the one taken."""
    choice = choose_model(robot, readings, springs, FitOptions())
    return calibrate(choice.model, readings, np.random.default_rng(0), ladder=choice.ladder)


def instructions(numbers: Design, data: np.ndarray) -> list[int]:
    """Return the instructions of each call of the exported deflection."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "c"
        write_c(folder, numbers)
        program, counts = folder / "count", folder / "callgrind.out"
        sources = [str(folder / "elastocal_model.c"), str(HARNESS), f"-I{folder}", "-DCOUNT"]
        subprocess.run(["gcc", "-std=c99", "-O2", *sources, "-o", program, "-lm"], check=True)
        tool = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={counts}"]
        subprocess.run(
            [*tool, program, "count"], input=data.tobytes(), capture_output=True, check=True
        )
        texts = [dump.read_text() for dump in folder.glob("callgrind.out.*")]
        return [
            int(total[1])
            for text in texts
            if "Client Request: deflection" in text
            and (total := re.search(r"(?m)^totals: (\d+)", text))
        ]


def main() -> None:
    """Measure and print."""
    robot, readings = measured()
    reference = processor_seconds(lambda: single(robot, readings))
    alone = ("18 springs alone, 200 draws", reference)
    sought = processor_seconds(lambda: find_undone(robot, readings))
    figure("mistakes undone, as in every `calibrate`", sought, alone)
    for springs in ("auto", "gears"):
        taken = processor_seconds(lambda springs=springs: whole(robot, readings, springs))
        name = f"the whole ladder, `--springs {springs}`, {len(readings)} readings"
        figure(name, taken, alone)
    plain, rich = (single(robot, readings, s).calibrated for s in ("bearing", "gears+friction"))
    data = rows(rich.model)
    pair, usual = side_by_side((plain, rich), data)
    steps = [median for median, _ in usual]
    last = f"{len(rich.model.parameters)} parameters of the last rung"
    figure(f"Python step, {last}", 1e-6 * steps[1], ("18 springs", 1e-6 * steps[0]))
    timed = c_microseconds(pair, data)
    if timed is None:
        return
    (bare, _), (full, step) = timed
    figure(f"C deflection, {last}", 1e-6 * full, ("18 springs", 1e-6 * bare))
    print(f"  its step: {step:.2f} us")
    if shutil.which("valgrind") is None:
        print("no valgrind: instructions are not counted")
        return
    counted = instructions(pair[1], data[:COUNTED])
    print(
        f"  instructions of {len(counted)} calls with other loads: {min(counted)} to {max(counted)}"
    )


if __name__ == "__main__":
    main()
