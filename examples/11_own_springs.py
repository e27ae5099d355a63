"""Springs of your own: an end-effector that gives way.

You learn how to make a spring layout, and how to decide whether it is worth its parameters: by the
error at left-out poses on the same readings, with an interval. The simulated tool gives way by
0.15 µm/N along each axis, which springs at the joints cannot express.
"""

from dataclasses import replace

import numpy as np

from elastocal.elastic import ElasticModel, Hinge, layout
from elastocal.identification import build, calibrate, leave_poses_out
from elastocal.robot import Robot, T_from_xyzabc, catalogue, with_tool
from elastocal.sim.arm import (
    SHOP_FLOOR,
    Linear,
    Linkage,
    TruthSpring,
    bearing_truth,
    measure,
    press_forces,
    press_poses,
)

COMPLIANCE = 0.15e-6  # m/N, of the tool along each axis
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}

urdf = catalogue.urdf("KR 120 R2700 extra HA")
urdf = with_tool(urdf, "flange", "tcp", T_from_xyzabc(0.15, 0.0, 0.35, 0.0, 0.0, 0.0))
robot, linkage = Robot.from_urdf(urdf, "tcp"), Linkage.from_urdf(urdf, "tcp")

# The true arm: three hinges at every joint, and a tool that slides against springs.
arm = bearing_truth(linkage)
slides = (
    TruthSpring("joint_a6", axis, Linear(1.0 / COMPLIANCE), revolute=False, distal=True)
    for axis in AXES.values()
)
arm = replace(arm, springs=(*arm.springs, *slides))

rng = np.random.default_rng(6)
pressed = press_poses(linkage, 31, rng)
data = measure(arm, pressed.joints, press_forces(pressed.T_base_tcp), SHOP_FLOOR, rng)
readings = data.readings(robot.joint_names)

# The paper's 18 springs, and the same with three linear ones behind the last joint.
eighteen = layout(robot, "bearing")
tool = tuple(
    Hinge(f"tool.{name}", "joint_a6", axis, revolute=False, distal=True)
    for name, axis in AXES.items()
)
errors = {}
for name, springs in (("18 springs", eighteen), ("with tool", (*eighteen, *tool))):
    held_out = leave_poses_out(build(ElasticModel(robot, springs), readings))
    errors[name] = held_out.error
    print(f"{name:10s} {1e6 * held_out.mean:6.1f} µm mean error at {held_out.folds} left-out poses")

# Paired over poses: how sure is the difference?
gain = (errors["18 springs"] - errors["with tool"]).reshape(31, 5).mean(axis=1)
draws = gain[rng.integers(31, size=(2000, 31))].mean(axis=1)
low, high = 1e6 * np.percentile(draws, [2.5, 97.5])
print(f"difference {1e6 * gain.mean():.1f} µm (95 %: {low:.1f} to {high:.1f} µm)")

calibrated = calibrate(ElasticModel(robot, (*eighteen, *tool)), readings, rng).calibrated
low, high = calibrated.interval()
for number, name in enumerate(calibrated.model.spring_names):
    if name.startswith("tool."):
        alone = calibrated.observability.observable[number]
        print(
            f"{name} {1e6 * calibrated.compliance[number]:.3f} µm/N"
            f" ({1e6 * low[number]:.3f} to {1e6 * high[number]:.3f}), true 0.150,"
            f" {'observable' if alone else 'only in sum with others'}"
        )
