"""How many poses were enough, and whether 18 springs pay: the dataset itself says.

You learn how to run the paper's repeated cross-validation (Algorithm 1) on a dataset, read its
verdict in words and in numbers, and draw the accuracy competency development chart (Fig. 9).
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

from elastocal.codec import cross_validate, judge, make_variants
from elastocal.report.plots import (
    codec_chart,
    write_figure,
)
from elastocal.robot import Robot, T_from_xyzabc, catalogue, with_tool
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

# Readings of a simulated arm that 18 springs cannot express exactly.
urdf = catalogue.urdf("KR 120 R2700 extra HA")
urdf = with_tool(urdf, "flange", "tcp", T_from_xyzabc(0.15, 0.0, 0.35, 0.0, 0.0, 0.0))
linkage = Linkage.from_urdf(urdf, "tcp")
bending = dict.fromkeys(linkage.joint_names[1:3], LINK_BENDING)
arm = with_stiffening_gears(with_link_bending(bearing_truth(linkage), bending))
rng = np.random.default_rng(0)
pressed = press_poses(linkage, 31, rng)
data = measure(arm, pressed.joints, press_forces(pressed.T_base_tcp), SHOP_FLOOR, rng)

# 31 verification sets of 9 poses; 1 to 22 of the others train, once with each spring layout.
robot = Robot.from_urdf(data.robot_urdf, data.tcp_frame)
variants = make_variants({"springs": ("actuated", "bearing")})
codec = cross_validate(robot, data.readings(robot.joint_names), variants)
verdicts = judge(codec)

for sentence in verdicts.sentences:
    print("-", sentence)

print("\nmedian of the mean error at held-out poses, in µm")
print("training poses", *(f"{n:5d}" for n in codec.n_train[::3]))
for variant in codec.variants:
    curve = 1e6 * np.median(codec.errors(variant.name), axis=0)
    print(f"{variant.name:14s}", *(f"{error:5.0f}" for error in curve[::3]))

chart = write_figure(folder / "codec.svg", lambda: codec_chart(codec, verdicts), "Codec")
print("\nchart written:", chart.name)
