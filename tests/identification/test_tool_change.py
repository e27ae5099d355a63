"""A model calibrated with one tool and used with another: the springs stay, the lever changes."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal.elastic import ElasticModel, Gear, bearing
from elastocal.errors import RobotError
from elastocal.identification import (
    CalibratedModel,
    CalibrateResult,
    FitOptions,
    Observability,
    Term,
    calibrate,
    read_model,
    unseen_groups,
    write_model,
)
from elastocal.robot import Robot, T_from_xyzabc, catalogue, with_tool
from elastocal.sim.arm import Linkage, Noise, bearing_truth, measure, press_forces, press_poses
from elastocal.sim.arm.elastic_arm import ElasticArm

FLANGE = catalogue.urdf("KR 300 R2500 ultra")
URDF = with_tool(FLANGE, "flange", "tcp", T_from_xyzabc(0.15, 0.0, 0.35, 0.0, 0.0, 0.0))
LONGER = T_from_xyzabc(0.0, 0.0, 0.1, 0.0, 0.0, 0.0)
ASIDE = T_from_xyzabc(0.0, 0.08, 0.0, 0.0, 0.0, 0.0)
TURNED = T_from_xyzabc(0.05, -0.02, 0.1, 0.4, -0.6, 1.1)
Q = np.radians([[10.0, -80.0, 90.0, 20.0, 50.0, -30.0], [-25.0, -60.0, 100.0, -40.0, 70.0, 80.0]])
FORCE = np.array([[200.0, -100.0, 900.0], [-300.0, 150.0, 600.0]])


def truth(urdf: str, tip: str) -> ElasticArm:
    return bearing_truth(Linkage.from_urdf(urdf, tip))


def relative_error(model: CalibratedModel, arm: ElasticArm) -> float:
    """Mean error at poses of its own, over the mean deflection there."""
    poses = press_poses(arm.linkage, 20, np.random.default_rng(9))
    force = press_forces(poses.T_base_tcp)
    true = arm.equilibrium(poses.joints[:, None], force).deflection.reshape(-1, 3)
    q = np.repeat(poses.joints, force.shape[1], axis=0)
    found = model.predict(q, force.reshape(-1, 3)).deflection
    return float(np.linalg.norm(found - true, axis=1).sum() / np.linalg.norm(true, axis=1).sum())


@pytest.fixture(scope="module")
def calibrated() -> CalibratedModel:
    arm, rng = truth(URDF, "tcp"), np.random.default_rng(1)
    poses = press_poses(arm.linkage, 31, rng)
    data = measure(arm, poses.joints, press_forces(poses.T_base_tcp), Noise(), rng)
    robot = Robot.from_urdf(URDF, "tcp")
    model = ElasticModel(robot, bearing(robot))
    return calibrate(model, data.readings(robot.joint_names), rng, FitOptions(draws=40)).calibrated


@pytest.mark.slow
@pytest.mark.parametrize("T", [LONGER, ASIDE], ids=["longer", "aside"])
def test_another_tool_is_predicted_nearly_as_well_as_the_calibrated_one(calibrated, T):
    arm = truth(with_tool(URDF, "tcp", "other", T), "other")
    own = relative_error(calibrated, truth(URDF, "tcp"))
    assert relative_error(calibrated.with_tool(T), arm) <= 1.3 * own
    # Without the tool's lever it is wrong by far more.
    assert relative_error(calibrated, arm) > 5.0 * own


@pytest.mark.parametrize("T", [LONGER, ASIDE, TURNED], ids=["longer", "aside", "turned"])
def test_it_is_the_model_of_the_urdf_that_has_the_tool(calibrated, T):
    robot = Robot.from_urdf(with_tool(URDF, "tcp", "other", T), "other")
    model = ElasticModel(robot, calibrated.model.springs)
    moment = np.array([[5.0, -40.0, 20.0], [60.0, 10.0, -30.0]])
    expected = model.deflection(calibrated.compliance, Q, FORCE, moment)
    found = calibrated.with_tool(T).predict(Q, FORCE, moment).deflection
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-18)


def test_springs_draws_and_observability_are_carried(calibrated):
    other = calibrated.with_tool(LONGER)
    assert other.model.springs == calibrated.model.springs
    assert other.observability == calibrated.observability
    np.testing.assert_array_equal(other.compliance, calibrated.compliance)
    np.testing.assert_array_equal(other.draws, calibrated.draws)
    assert other.misfit == calibrated.misfit


def test_a_tool_and_back_is_the_calibrated_one(calibrated):
    back = calibrated.with_tool(TURNED).with_tool(np.linalg.inv(TURNED))
    np.testing.assert_allclose(
        back.predict(Q, FORCE).deflection, calibrated.predict(Q, FORCE).deflection, rtol=1e-9
    )
    assert back.tool is not None
    np.testing.assert_allclose(back.tool.pose, np.zeros(6), atol=1e-12)
    assert back.tool.calibrated_tcp == "tcp"


def test_gravity_of_a_robot_that_hangs_is_kept(calibrated):
    hanging = replace(calibrated.model.robot, gravity=(0.0, 0.0, 9.80665))
    model = replace(calibrated, model=ElasticModel(hanging, calibrated.model.springs))
    assert model.with_tool(LONGER).model.robot.gravity == (0.0, 0.0, 9.80665)


def sag(model: CalibratedModel) -> np.ndarray:
    return np.asarray(model.model.sag_blocks(Q) @ model.compliance)


def test_a_mass_changes_the_sag_and_no_deflection_of_linear_springs(calibrated):
    bare = calibrated.with_tool(LONGER)
    heavy = calibrated.with_tool(LONGER, mass=60.0, centre=(0.02, 0.0, -0.1))
    np.testing.assert_array_equal(
        heavy.predict(Q, FORCE).deflection, bare.predict(Q, FORCE).deflection
    )
    # What the weight deflects more is a force at the centre of mass.
    lever = heavy.model.robot.forward(Q)[:, :3, :3] @ (0.02, 0.0, -0.1)
    weight = np.broadcast_to(60.0 * np.array([0.0, 0.0, -9.80665]), (2, 3))
    more = bare.model.deflection(bare.compliance, Q, weight, np.cross(lever, weight))
    np.testing.assert_allclose(sag(heavy) - sag(bare), more, rtol=1e-9)


def test_the_new_mass_stands_in_place_of_the_calibrated_tools(calibrated):
    tool = T_from_xyzabc(0.15, 0.0, 0.35, 0.0, 0.0, 0.0)
    robot = Robot.from_urdf(with_tool(FLANGE, "flange", "tcp", tool, 60.0, (0, 0, -0.1)), "tcp")
    loaded = replace(calibrated, model=ElasticModel(robot, calibrated.model.springs))
    light = loaded.with_tool(np.eye(4), mass=1e-12, centre=(0.0, 0.0, 0.0))
    np.testing.assert_allclose(sag(light), sag(calibrated), rtol=1e-9)
    kept = loaded.with_tool(np.eye(4))
    np.testing.assert_allclose(sag(kept), sag(loaded), rtol=1e-12)


def test_a_mass_preloads_gears():
    robot = Robot.from_urdf(URDF, "tcp")
    gear = Gear("joint_a2.axial", "joint_a2", (0.0, 0.0, 1.0), knees=(300.0,))
    gear = replace(gear, axis=tuple(robot.chain.joints[1].axis))
    model = ElasticModel(robot, (gear,))
    n = len(model.parameters)
    seen = Observability(n, 1.0, (True,) * n, ())
    calibrated = CalibratedModel(model, np.full(n, 1e-6), np.full((40, n), 1e-6), seen)
    bare, heavy = (calibrated.with_tool(LONGER, m, (0.0, 0.0, 0.0)) for m in (1e-9, 100.0))
    free, preloaded = (
        np.linalg.norm(m.predict(Q, FORCE).deflection, axis=1) for m in (bare, heavy)
    )
    assert np.all(np.abs(preloaded / free - 1.0) > 1e-3)


def test_a_mass_without_its_centre_is_refused(calibrated):
    with pytest.raises(RobotError, match="both a mass and a centre"):
        calibrated.with_tool(LONGER, mass=3.0)
    with pytest.raises(RobotError, match="must be above 0"):
        calibrated.with_tool(LONGER, mass=-3.0, centre=(0.0, 0.0, 0.0))


def test_the_model_says_which_tool_it_is_for_and_so_does_its_file(calibrated, tmp_path):
    other = calibrated.with_tool(LONGER, 12.0, (0.0, 0.0, -0.05))
    assert calibrated.tool_name == "tcp, as calibrated"
    assert "0 mm, 0 mm, 100 mm, 0 deg, 0 deg, 0 deg in tcp, 12 kg" in other.tool_name
    write_model(tmp_path / "other.json", other)
    again = read_model(tmp_path / "other.json")
    assert again.tool == other.tool
    assert dict(CalibrateResult.of(again).facts())["tool"] == other.tool_name
    np.testing.assert_array_equal(
        again.predict(Q, FORCE).deflection, other.predict(Q, FORCE).deflection
    )


def test_springs_that_only_the_new_tool_loads_are_named():
    """With its tcp on the axis of the last joint a robot cannot show that joint's spring."""
    urdf = with_tool(FLANGE, "flange", "tcp", T_from_xyzabc(0.0, 0.0, 0.3, 0.0, 0.0, 0.0))
    robot = Robot.from_urdf(urdf, "tcp")
    model = ElasticModel(robot, bearing(robot))
    names = model.parameter_names
    last = "joint_a6.axial"
    seen = Observability(
        len(names) - 1, 9.0, tuple(name != last for name in names), ((Term(last, 1.0),),)
    )
    calibrated = CalibratedModel(model, np.full(18, 1e-7), np.full((40, 18), 1e-7), seen)
    assert unseen_groups(calibrated.with_tool(LONGER).model, seen, model) == ()
    assert unseen_groups(calibrated.with_tool(ASIDE).model, seen, model) == seen.unobservable


def test_a_combination_that_both_tools_load_alike_is_no_matter_of_the_tool():
    """Few poses hide what forces elsewhere load; the tool has no part in it."""
    robot = Robot.from_urdf(URDF, "tcp")
    model = ElasticModel(robot, bearing(robot))
    names = model.parameter_names
    hidden = (Term("joint_a2.axial", 1.0),)
    seen = Observability(
        len(names) - 1, 9.0, tuple(n != hidden[0].spring for n in names), (hidden,)
    )
    calibrated = CalibratedModel(model, np.full(18, 1e-7), np.full((40, 18), 1e-7), seen)
    for tool in (np.eye(4), LONGER, ASIDE):
        other = calibrated.with_tool(tool)
        assert unseen_groups(other.model, seen, other.calibrated_model) == ()


def test_the_model_at_the_calibrated_tool_is_found_again():
    robot = Robot.from_urdf(URDF, "tcp")
    model = ElasticModel(replace(robot, gravity=(0.0, 9.8, 0.0)), bearing(robot))
    seen = Observability(18, 9.0, (True,) * 18, ())
    calibrated = CalibratedModel(model, np.full(18, 1e-7), np.full((40, 18), 1e-7), seen)
    again = calibrated.with_tool(LONGER).with_tool(ASIDE).calibrated_model
    np.testing.assert_allclose(
        again.observation_blocks(Q, FORCE), model.observation_blocks(Q, FORCE), rtol=1e-12
    )
    np.testing.assert_allclose(again.sag_blocks(Q), model.sag_blocks(Q), rtol=1e-12)
