"""From a dataset to a calibrated model.

You learn how to calibrate, and where the answers to a user's first questions are: how large is the
error at poses that were left out, are 18 springs better than 6, which springs are known, which
readings look wrong. The readings are those of a simulated arm with bending links and stiffening
gears, which no springs at the joints can express; one reading is spoilt on purpose.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

import elastocal as ec
from elastocal.dataset import write
from elastocal.robot import T_from_xyzabc, catalogue, with_tool
from elastocal.sim.arm import (
    LINK_BENDING,
    SHOP_FLOOR,
    Blunder,
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
linkage = Linkage.from_urdf(urdf, "tcp")
bending = dict.fromkeys(linkage.joint_names[1:3], LINK_BENDING)
arm = with_stiffening_gears(with_link_bending(bearing_truth(linkage), bending))

rng = np.random.default_rng(1)
pressed = press_poses(linkage, 31, rng)
forces = press_forces(pressed.T_base_tcp)
spoilt = (Blunder(12, "north", (0.0, 4e-3, 0.0)),)
write(measure(arm, pressed.joints, forces, SHOP_FLOOR, rng, blunders=spoilt), folder / "dataset.nc")

# From here on it is as with your own data. The dataset carries the URDF and the tcp's name.
result = ec.calibrate(folder / "dataset.nc", out=folder / "model.json")
figures = result.calibration
mm = 1e3
print(f"{figures.readings} readings at {figures.poses} poses")
print(f"deflection measured: {mm * figures.deflection.mean:.3f} mm mean")
print(f"error at left-out poses: {mm * figures.held_out.mean:.3f} mm mean")
for rung in figures.ladder:  # models from simple to rich, at the same left-out poses
    taken = "  taken" if rung.chosen else ""
    print(f"{rung.springs:14s} misses by {mm * rung.held_out:.3f} mm{taken}")
for spring in figures.springs[:6]:
    known = "" if spring.observable else "  (only in sum with others)"
    print(f"{spring.name:14s} {1e6 * spring.compliance:6.3f} µrad/(N·m){known}")
for reading in figures.suspicious:
    aside = "set aside" if reading.set_aside else "kept"
    print(f"looks wrong: pose {reading.pose} {reading.load_case}, {aside}")
print("written: dataset.nc, model.json")
