"""How a robot with springs yields to a force.

You learn how to put a tool on a robot of the catalogue, give it the paper's 18 springs, ask for the
deflection of its tool centre point, and see that the deflection is linear in the compliances
(paper Eq. 10, 11): that is what makes them identifiable.
"""

import numpy as np

import elastocal as ec
from elastocal.elastic import layout
from elastocal.robot import T_from_xyzabc, catalogue, with_tool

# A tool that stands 350 mm out of the flange and 150 mm aside; its z axis points out of it.
urdf = catalogue.urdf("KR 120 R2700 extra HA")
urdf = with_tool(urdf, "flange", "tcp", T_from_xyzabc(0.15, 0.0, 0.35, 0.0, 0.0, 0.0))
robot = ec.Robot.from_urdf(urdf, "tcp")

# Compliances in rad/(N·m). These are guesses of a plausible size; a calibration would know them.
model = ec.ElasticModel(robot, layout(robot, "bearing"))
axial = [0.4e-6, 0.35e-6, 0.4e-6, 1.2e-6, 1.6e-6, 3.0e-6]
compliance = np.array(axial + [0.2 * c for c in axial for _ in range(2)])

# Pressing with 1100 N: the force on the robot points back along -z of the tool.
q = np.radians([10.0, -80.0, 100.0, 5.0, 60.0, 0.0])
T_base_tcp = robot.forward(q)
force = T_base_tcp[:3, :3] @ [0.0, 0.0, -1100.0]

deflection = model.deflection(compliance, q, force)
print(f"{robot.name} with {len(model.springs)} springs: {', '.join(model.spring_names[:3])}, ...")
print("tool centre point at", np.round(1e3 * T_base_tcp[:3, 3], 1), "mm")
print("force on the robot", np.round(force, 1), "N in base")
print("deflection", np.round(1e3 * deflection, 3), "mm in base")

# The same by the observation matrix: one row block of the least squares (paper Eq. 11, 14).
rows = model.observation_blocks(q, force)
print(
    f"O c differs by {np.abs(rows @ compliance - deflection).max():.1e} m; O has shape {rows.shape}"
)

# How stiff the pose is along each axis of base while the tool may yield sideways.
C = model.cartesian_compliance(compliance, q).translation
stiffness = 1e-6 / np.diag(C)
print("stiffness along x, y, z of base", np.round(stiffness, 2), "N/µm")
