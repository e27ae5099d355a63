"""How far the tool will yield, and how sure that is.

You learn how to predict deflections at poses that were not measured, and what the two 95 %
intervals hold. That of the fit says what another campaign would have predicted: it holds the truth
as often as it says only when the springs can express the arm. That of a measurement holds the
misfit and the noise of a measurement as well; the truth, which has no noise, lies well inside.
"""

import numpy as np

import elastocal as ec
from elastocal.elastic import layout
from elastocal.identification import calibrate, summary
from elastocal.robot import T_from_xyzabc, catalogue, with_tool
from elastocal.sim.arm import (
    LINK_BENDING,
    SHOP_FLOOR,
    Linkage,
    Noise,
    bearing_truth,
    measure,
    press_forces,
    press_poses,
    with_link_bending,
    with_stiffening_gears,
)

urdf = catalogue.urdf("KR 120 R2700 extra HA")
urdf = with_tool(urdf, "flange", "tcp", T_from_xyzabc(0.15, 0.0, 0.35, 0.0, 0.0, 0.0))
robot, linkage = ec.Robot.from_urdf(urdf, "tcp"), Linkage.from_urdf(urdf, "tcp")
model = ec.ElasticModel(robot, layout(robot, "bearing"))

hinges = bearing_truth(linkage)
bending = dict.fromkeys(linkage.joint_names[1:3], LINK_BENDING)
arms = {
    "18 hinges": hinges,
    "bending links, stiffening gears": with_stiffening_gears(with_link_bending(hinges, bending)),
}


def readings_of(arm, poses, noise, rng):
    """Return readings of an arm that presses at poses spread over a dome."""
    pressed = press_poses(linkage, poses, rng)
    data = measure(arm, pressed.joints, press_forces(pressed.T_base_tcp), noise, rng)
    return data.readings(robot.joint_names)


for name, arm in arms.items():
    rng = np.random.default_rng(2)
    calibration = calibrate(model, readings_of(arm, 31, SHOP_FLOOR, rng), rng)
    unseen = readings_of(arm, 40, Noise(), rng)
    predicted = calibration.calibrated.predict(unseen.joint_position, unseen.force)

    error = np.linalg.norm(predicted.deflection - unseen.deflection, axis=1)
    truth = unseen.deflection
    fit = (predicted.low <= truth) & (truth <= predicted.high)
    measured = (predicted.measured_low <= truth) & (truth <= predicted.measured_high)
    print(f"true arm: {name}")
    print(f"  error at left-out poses  {1e6 * summary(calibration).held_out.mean:5.0f} µm")
    print(f"  error at unseen poses    {1e6 * error.mean():5.0f} µm, against the truth")
    for what, low, high, inside in (
        ("fit", predicted.low, predicted.high, fit),
        ("measurement", predicted.measured_low, predicted.measured_high, measured),
    ):
        print(
            f"  interval of the {what:11s} ±{1e6 * (high - low).mean() / 2:3.0f} µm on average,"
            f" holds {100 * inside.mean():3.0f} % of the true deflections"
        )
