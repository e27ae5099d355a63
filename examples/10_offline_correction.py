"""Correct a programmed path before it is run.

You learn how to write a path with its forces, have it corrected to the true inverse (the loaded
tool is where the path has it), and check the result on the simulated arm that the model was
calibrated on, which bends in ways that 18 springs cannot express.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

import elastocal as ec
from elastocal.compensation.offline import compensate_path
from elastocal.elastic import layout
from elastocal.identification import calibrate
from elastocal.robot import T_from_xyzabc, catalogue, with_tool
from elastocal.robot.inverse import inverse_for, joints_along_path
from elastocal.sim.arm import (
    LINK_BENDING,
    SHOP_FLOOR,
    Linkage,
    bearing_truth,
    measure,
    press_forces,
    press_poses,
    with_link_bending,
    with_stiffening_gears,
)

folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(tempfile.mkdtemp(prefix="elastocal-"))
folder.mkdir(parents=True, exist_ok=True)

urdf = catalogue.urdf("KR 120 R2700 extra HA")
urdf = with_tool(urdf, "flange", "tcp", T_from_xyzabc(0.15, 0.0, 0.35, 0.0, 0.0, 0.0))
robot, linkage = ec.Robot.from_urdf(urdf, "tcp"), Linkage.from_urdf(urdf, "tcp")
bending = dict.fromkeys(linkage.joint_names[1:3], LINK_BENDING)
arm = with_stiffening_gears(with_link_bending(bearing_truth(linkage), bending))
rng = np.random.default_rng(5)
pressed = press_poses(linkage, 31, rng)
data = measure(arm, pressed.joints, press_forces(pressed.T_base_tcp), SHOP_FLOOR, rng)
model = ec.ElasticModel(robot, layout(robot, "bearing"))
calibrated = calibrate(model, data.readings(robot.joint_names), rng).calibrated

# A straight course of 0.8 m across the dome, the tool pointing down, pressing with 1100 N and
# pushed aside by up to 280 N.
way = np.linspace(0.0, 1.0, 81)
course = T_from_xyzabc(1.6, -0.4 + 0.8 * way, 0.8, 0.0, np.pi, 0.0)
force_tcp = np.column_stack([280.0 * np.sin(6.0 * way), 0.0 * way, np.full(len(way), -1100.0)])
start = np.array([0.0, -1.75, 1.9, 0.0, 1.0, 0.0])
no_rail = np.zeros((len(way), 0))
q = joints_along_path(inverse_for(robot), course, no_rail, start, lambda row: f"point {row}")
force = np.einsum("pij,pj->pi", robot.forward(q)[:, :3, :3], force_tcp)

joints = [f"{name}[rad]" for name in robot.joint_names]
header = ",".join([*joints, *(f"force_{axis}[N]" for axis in "xyz")])
rows = np.hstack([q, force])
path, out = folder / "path.csv", folder / "corrected.csv"
np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.17g")
tally = compensate_path(calibrated, path, out)
print(f"{tally.rows} points corrected, by at most {1e3 * tally.figures().correction.max:.2f} mm")

# Now run both paths on the true arm and see how far the loaded tool is from the course.
corrected = np.loadtxt(out, delimiter=",", skiprows=1)[:, : len(joints)]
for name, commanded in (("as programmed", q), ("corrected", corrected)):
    reached = robot.forward(commanded)[:, :3, 3] + arm.equilibrium(commanded, force).deflection
    away = 1e3 * np.linalg.norm(reached - course[:, :3, 3], axis=1)
    print(f"{name:14s} {away.mean():.3f} mm mean, {away.max():.3f} mm max from the course")
