"""The demo's cell: a true arm that no 18 springs can express, and what is made of its readings.

A composition root: the only place outside the tests that brings simulator and estimator together.
"""

import csv
from pathlib import Path

import numpy as np
from numpy.random import Generator
from rich.console import Console

from elastocal import dataset
from elastocal.arrays import FloatArray
from elastocal.cli.calibrate import calibrate
from elastocal.cli.predict import predict
from elastocal.dataset import Readings
from elastocal.dataset.load_rows import joint_dimensions, read_load_rows
from elastocal.errors import FileAccessError
from elastocal.robot import catalogue
from elastocal.robot.mounting import with_tool
from elastocal.sim.layouts import (
    LINK_BENDING,
    bearing_truth,
    with_link_bending,
    with_stiffening_gears,
)
from elastocal.sim.linkage import Linkage
from elastocal.sim.measurement import SHOP_FLOOR, Blunder, Noise, measure
from elastocal.sim.scene import press_forces, press_poses
from elastocal.sim.truth import ElasticArm

ROBOT = "KR 120 R2700 extra HA"
"""The robot of the paper's fibre placement cell."""
POSES, UNSEEN = 31, 20
BLUNDER = Blunder(12, "north", (0.0, 4e-3, 0.0))
"""One reading in which the tracker beam was disturbed, so that the demo shows how it is found."""
T_FLANGE_TCP = np.array(
    [[1.0, 0.0, 0.0, 0.15], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.35], [0.0, 0.0, 0.0, 1.0]]
)
"""Calibration tool in place of the compaction roller: 350 mm out, 150 mm aside."""


def run_demo(console: Console, out: Path, seed: int) -> None:
    """Measure a simulated cell, calibrate, predict at unseen poses, compare with the truth."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileAccessError(f"cannot make folder {out}: {error.strerror}") from error
    rng = np.random.default_rng(seed)
    arm = true_arm()
    data, rows, model = out / "dataset.nc", out / "unseen.csv", out / "model.json"

    console.rule("1. measure: 31 poses, 5 load cases, with noise and one blunder")
    dataset.write(_measured(arm, POSES, SHOP_FLOOR, rng, (BLUNDER,)), data)
    console.print(f"dataset written to {data}", markup=False, soft_wrap=True)

    console.rule("2. elastocal calibrate")
    calibrate(data, model)

    console.rule("3. elastocal predict, at poses that were not measured")
    unseen = _measured(arm, UNSEEN, Noise(), rng).readings(arm.linkage.joint_names)
    _write_rows(rows, unseen, arm.linkage.joint_names)
    predict(model, rows, out / "predicted.csv")
    _compare(console, out / "predicted.csv", unseen, arm)


def true_arm() -> ElasticArm:
    """Return the demo's arm: hinges at every joint, bending links, stiffening gears."""
    urdf = with_tool(catalogue.urdf(ROBOT), "flange", "tcp", T_FLANGE_TCP)
    linkage = Linkage.from_urdf(urdf, "tcp")
    bending = dict.fromkeys(linkage.joint_names[1:3], LINK_BENDING)
    return with_stiffening_gears(with_link_bending(bearing_truth(linkage), bending))


def _measured(
    arm: ElasticArm, poses: int, noise: Noise, rng: Generator, blunders: tuple[Blunder, ...] = ()
) -> dataset.Dataset:
    pressed = press_poses(arm.linkage, poses, rng)
    return measure(
        arm, pressed.joints, press_forces(pressed.T_base_tcp), noise, rng, blunders=blunders
    )


def _write_rows(path: Path, readings: Readings, joints: tuple[str, ...]) -> None:
    header = [f"{joint}[rad]" for joint in joints] + [f"force_{axis}[N]" for axis in "xyz"]
    values = np.hstack([readings.joint_position, readings.force])
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows([repr(float(value)) for value in row] for row in values)


def _compare(console: Console, path: Path, truth: Readings, arm: ElasticArm) -> None:
    """Set the predictions against the truth that only a simulation knows."""
    predicted = _predicted(path, arm)
    before = np.linalg.norm(truth.deflection, axis=1)
    after = np.linalg.norm(truth.deflection - predicted, axis=1)
    console.rule("4. against the truth, which only a simulation knows")
    console.print(
        f"true deflection at {UNSEEN} unseen poses: {1e3 * before.mean():.3f} mm mean,"
        f" {1e3 * before.max():.3f} mm max\n"
        f"left after subtracting the prediction: [bold]{1e3 * after.mean():.3f} mm[/bold] mean,"
        f" {1e3 * after.max():.3f} mm max"
        f" ([bold]{100 * (after.mean() / before.mean() - 1):.1f} %[/bold] mean)\n\n"
        f"results are in [bold]{path.parent}[/bold]: dataset.nc, model.json, unseen.csv,"
        " predicted.csv"
    )


def _predicted(path: Path, arm: ElasticArm) -> FloatArray:
    joints = joint_dimensions(arm.linkage.joint_names, arm.linkage.revolute)
    rows = read_load_rows(path, joints)
    columns = [rows.header.index(f"deflection_{axis}[m]") for axis in "xyz"]
    return np.array([[float(row[column]) for column in columns] for row in rows.cells])
