"""From averaged sensor logs to a dataset, and on to a model.

You learn how to turn what your own instruments logged into the readings that a calibration wants:
the force without the tool's weight, in base (the unloaded reading of the same pose is the tare),
and the tracker's displacements in base (its place is found from the unloaded readings).
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

import elastocal as ec
from elastocal.cell import SensorLoad
from elastocal.dataset import write
from elastocal.procedure.registration import UnloadedReadings, register
from elastocal.robot import T_from_xyzabc, catalogue, with_tool
from elastocal.sim.arm import (
    LOAD_CASES,
    SHOP_FLOOR,
    Linkage,
    bearing_truth,
    measure,
    press_forces,
    press_poses,
)

folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(tempfile.mkdtemp(prefix="elastocal-"))
folder.mkdir(parents=True, exist_ok=True)
urdf = catalogue.urdf("KR 120 R2700 extra HA")
urdf = with_tool(urdf, "flange", "tcp", T_from_xyzabc(0.15, 0.0, 0.35, 0.0, 0.0, 0.0))
robot, linkage = ec.Robot.from_urdf(urdf, "tcp"), Linkage.from_urdf(urdf, "tcp")

# What the instruments logged, averaged over a second each. Simulated here; yours come from files.
rng = np.random.default_rng(8)
pressed = press_poses(linkage, 31, rng)
data = measure(
    bearing_truth(linkage), pressed.joints, press_forces(pressed.T_base_tcp), SHOP_FLOOR, rng
)
q, contact_force, moved = data.joint_position, data.force, data.marker_displacement
tool = SensorLoad(
    mass=60.0, centre=np.array([0, 0, 0.15]), T_tcp_sensor=T_from_xyzabc(0, 0, -0.3, 0.5, 0, 0)
)
T_tracker_base = T_from_xyzabc(2.0, 5.0, 1.0, 2.5, 0.02, -0.01)  # nobody knows it
before = pressed.T_base_tcp.copy()  # the controller's pose unloaded, 3 mm before contact
before[:, :3, 3] = data.tcp_position
loaded = robot.forward(q)  # and under each load
bias = np.array([12.0, -7.0, 30.0])
R, R_0 = tool.R_base_sensor(loaded), tool.R_base_sensor(before)
raw = np.einsum("plji,plj->pli", R, contact_force) + tool.weight(R)[..., :3] + bias  # sensor frame
raw_0 = tool.weight(R_0)[..., :3] + bias
R_tracker_base, t_tracker_base = T_tracker_base[:3, :3], T_tracker_base[:3, 3]
marker_0 = before[:, :3, 3] @ R_tracker_base.T + t_tracker_base  # tracker frame
marker = marker_0[:, None] + moved @ R_tracker_base.T

# 1. Where does the tracker stand? The unloaded readings say it, and where the marker sits.
poses = np.arange(len(q))
unloaded = UnloadedReadings(
    poses, ("tracker",) * len(q), marker_0, np.full(len(q), 2e-5), before, np.zeros((len(q), 3, 0))
)
found = register(unloaded, np.zeros(3))
R_base_tracker = found.stations[0].T_base_tracker[:3, :3]
print(f"turn of the tracker known to {1e6 * found.stations[0].rotation_sigma:.0f} µrad")
print(f"marker in the tcp frame: {np.round(1e3 * found.lever_arm, 2) + 0.0} mm")

# 2. Forces on the robot in base, f = R (F - F_0 - m (R^T g - R_0^T g)); displacements in base.
shown = raw - raw_0[:, None] - (tool.weight(R)[..., :3] - tool.weight(R_0)[..., :3][:, None])
force = np.einsum("plij,plj->pli", R, shown)
dataset = ec.Dataset.from_arrays(
    joint_position=q,
    force=force,
    controller_displacement=loaded[..., :3, 3] - before[:, None, :3, 3],
    marker_displacement=(marker - marker_0[:, None]) @ R_base_tracker.T,
    joint_names=robot.joint_names,
    load_cases=LOAD_CASES,
    tcp_position=before[:, :3, 3],
    provenance="sensor logs of an example",
)
write(dataset, folder / "readings.csv")
(folder / "robot.urdf").write_text(urdf, encoding="utf-8")

# 3. As `elastocal calibrate readings.csv --robot robot.urdf --tcp tcp` does.
figures = ec.calibrate(
    folder / "readings.csv", robot=str(folder / "robot.urdf"), tcp="tcp"
).calibration
print(
    f"{figures.readings} readings written to readings.csv; first force {np.round(force[0, 0], 1)} N"
)
print(f"error at left-out poses: {1e3 * figures.held_out.mean:.3f} mm mean")
for warning in figures.warnings:
    print("warning:", warning)
