"""What hangs on the force sensor, from static postures.

You learn how to find mass, centre of mass, sensor bias and the sensor's rotation from raw wrenches
of an unloaded arm, what intervals they have, and what happens when all postures look the same way.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.compensation.conditioning import ToolModel, choose_tool, static_postures

MASS, CENTRE = 60.0, np.array([0.01, -0.02, 0.18])  # kg, m: a placement head
BIAS, MOMENT_BIAS = np.array([12.0, -7.0, 30.0]), np.array([1.0, 0.4, -0.6])  # N, N·m
R_FLANGE_SENSOR = Rotation.from_euler("z", 30.5, degrees=True).as_matrix()
GRAVITY = np.array([0.0, 0.0, -9.80665])

rng = np.random.default_rng(3)


def raw_wrenches(R_base_flange):
    """Return what the sensor reads: the weight in its own axes, its bias, its noise."""
    weight = MASS * np.einsum("pji,j->pi", R_base_flange @ R_FLANGE_SENSOR, GRAVITY)
    force = weight + BIAS + rng.normal(0.0, 0.5, weight.shape)
    moment = np.cross(CENTRE, weight) + MOMENT_BIAS + rng.normal(0.0, 0.05, weight.shape)
    return force, moment


# Twelve postures that turn the sensor about two axes. It was mounted at 30 degrees, or nearly so.
turned = Rotation.from_euler("xyz", rng.uniform(-1.2, 1.2, (12, 3))).as_matrix()
nominal = Rotation.from_euler("z", 30.0, degrees=True).as_matrix()
richest = ToolModel(rotation=True, drift=True, cross_talk=0.001)  # by the sensor's data sheet
fit = choose_tool(static_postures(turned, *raw_wrenches(turned)), nominal, richest).fit

off = Rotation.from_matrix(nominal.T @ fit.R_flange_sensor).as_rotvec(degrees=True)
print(f"{fit.count} postures, scatter {fit.force_scatter:.2f} N")
print(f"mass            {fit.mass:8.3f} kg ± {fit.half_width['mass']:.3f}   (true {MASS:.3f})")
print(f"centre of mass  {np.round(1e3 * fit.centre, 1)} mm   (true {1e3 * CENTRE})")
print(f"force bias      {np.round(fit.force_bias, 1)} N   (true {BIAS})")
print(f"rotation off the nominal one  {np.round(off, 2)} deg   (true 0, 0, 0.5)")

# Turns about the vertical axis only: gravity always looks the same, and the fit says so.
same = Rotation.from_euler("z", np.linspace(0.0, 3.0, 8)[:, None]).as_matrix()
fit = choose_tool(static_postures(same, *raw_wrenches(same)), nominal, richest).fit
print(f"\n{fit.count} postures turned about the vertical axis only")
print("not determined:", ", ".join(fit.undetermined))
