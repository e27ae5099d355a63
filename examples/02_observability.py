"""Why 18 springs are never all observable, and which combinations are not.

You learn how to ask a set of poses and load cases what it tells about each spring. Forces at the
tool centre point never separate all 18 springs, however many poses are taken: on this arm 14
directions are seen. Fourteen springs fit as well, and each has a value of its own.
"""

import numpy as np

import elastocal as ec
from elastocal.elastic import layout
from elastocal.identification import build, describe, observability, solve
from elastocal.robot import T_from_xyzabc, catalogue, with_tool
from elastocal.sim.arm import (
    SHOP_FLOOR,
    Linkage,
    bearing_truth,
    measure,
    press_forces,
    press_poses,
)

urdf = catalogue.urdf("KR 120 R2700 extra HA")
urdf = with_tool(urdf, "flange", "tcp", T_from_xyzabc(0.15, 0.0, 0.35, 0.0, 0.0, 0.0))
robot = ec.Robot.from_urdf(urdf, "tcp")

# Readings of a simulated arm at 31 poses on a dome, five load cases each.
rng = np.random.default_rng(1)
linkage = Linkage.from_urdf(urdf, "tcp")
pressed = press_poses(linkage, 31, rng)
data = measure(
    bearing_truth(linkage), pressed.joints, press_forces(pressed.T_base_tcp), SHOP_FLOOR, rng
)
readings = data.readings(robot.joint_names)


def seen(springs, chosen):
    """Return what some of the readings tell about springs, and the median error of their fit."""
    problem = build(ec.ElasticModel(robot, springs), chosen)
    solution = solve(problem)
    error = np.linalg.norm(problem.residuals(solution.compliance), axis=1)
    return observability(solution.factored, springs), 1e6 * float(np.median(error))


eighteen = layout(robot, "bearing")
pressing_only = readings.take(readings.load_case == "normal")
for what, chosen in (("normal load alone", pressing_only), ("five load cases", readings)):
    found, error = seen(eighteen, chosen)
    print(
        f"{what:18s} rank {found.rank} of {found.springs}, condition {found.condition:5.0f},"
        f" median residual {error:.0f} µm"
    )

print("these combinations change no deflection:")
for group in seen(eighteen, readings)[0].unobservable:
    print("  ", describe(group))

left_out = {"joint_a5.x", "joint_a5.z", "joint_a6.y", "joint_a6.z"}
fourteen = tuple(spring for spring in eighteen if spring.name not in left_out)
found, error = seen(fourteen, readings)
print(f"without {', '.join(sorted(left_out))}:")
print(
    f"rank {found.rank} of {found.springs}, every spring observable: {all(found.observable)},"
    f" median residual {error:.0f} µm"
)
