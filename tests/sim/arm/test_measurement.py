import numpy as np
import pytest

from elastocal.errors import DatasetError, UnreachableError
from elastocal.sim.arm import (
    LOAD_CASES,
    SHOP_FLOOR,
    Blunder,
    Noise,
    bearing_truth,
    measure,
    with_link_bending,
    with_stiffening_gears,
)
from elastocal.sim.arm.elastic_arm import GRAVITY
from elastocal.sim.arm.measurement import Contact


@pytest.fixture(scope="module")
def arm(linkage):
    arm = with_link_bending(bearing_truth(linkage, gravity=GRAVITY), {"a2": 9e6})
    return with_stiffening_gears(arm)


def readings(arm, poses, forces, noise=None, seed=4, **options):
    rng = np.random.default_rng(seed)
    return measure(arm, poses.joints, forces, noise or Noise(), rng, **options).to_xarray()


def difference(data):
    return (data["marker_displacement"] - data["controller_displacement"]).values


@pytest.fixture(scope="module")
def exact(arm, poses, forces):
    return readings(arm, poses, forces)


def hanging(arm, q):
    """Return by how much the unloaded tip hangs off where the joints say it is."""
    return arm.equilibrium(q, np.zeros(3)).tcp_position - arm.linkage.forward(q)[..., :3, 3]


def test_without_noise_or_weight_marker_minus_controller_is_the_deflection(linkage, poses, forces):
    weightless = bearing_truth(linkage)
    exact = readings(weightless, poses, forces)
    truth = weightless.equilibrium(exact["joint_position"].values, forces)
    np.testing.assert_allclose(difference(exact), truth.deflection, rtol=0, atol=1e-15)
    np.testing.assert_array_equal(exact["force"].values, forces)
    assert "reference_joint_position" not in exact


def test_under_gravity_it_also_holds_the_change_of_sag_since_the_reference(arm, exact, forces):
    # A tracker sees two true positions: what the arm sags differently at the two is among them.
    q, q_0 = exact["joint_position"].values, exact["reference_joint_position"].values
    change = hanging(arm, q) - hanging(arm, q_0)[:, None]
    deflection = arm.equilibrium(q, forces).deflection
    np.testing.assert_allclose(difference(exact), deflection + change, rtol=0, atol=1e-12)
    assert np.linalg.norm(change, axis=-1).max() > 1e-6


def test_the_marker_moves_between_two_true_positions_of_the_tip(arm, exact, forces):
    q, q_0 = exact["joint_position"].values, exact["reference_joint_position"].values
    before = arm.equilibrium(q_0, np.zeros(3)).tcp_position
    after = arm.equilibrium(q, forces).tcp_position
    moved = after - before[:, None]
    np.testing.assert_allclose(moved, exact["marker_displacement"].values, rtol=0, atol=1e-7)


def test_the_reference_is_read_where_the_tool_stops_off_the_surface(arm, exact):
    rigid = arm.linkage.forward(exact["reference_joint_position"].values)[:, :3, 3]
    np.testing.assert_allclose(rigid, exact["tcp_position"].values, rtol=0, atol=1e-9)


def test_gravity_that_is_not_an_upright_base_s_is_recorded(linkage, poses, forces, exact):
    sideways = readings(bearing_truth(linkage, gravity=(9.0, 0.0, 0.0)), poses, forces)
    assert sideways.attrs["gravity"] == "9.0 m/s2, 0.0 m/s2, 0.0 m/s2"
    assert "gravity" not in exact.attrs


def test_recorded_joints_are_where_the_controller_says_it_is(arm, exact):
    commanded = arm.linkage.forward(exact["joint_position"].values)[..., :3, 3]
    reported = exact["tcp_position"].values[:, None] + exact["controller_displacement"].values
    np.testing.assert_allclose(commanded, reported, atol=5e-8)


def test_the_controller_keeps_the_orientation(arm, exact, poses):
    commanded = arm.linkage.forward(exact["joint_position"].values)[..., :3, :3]
    wanted = np.broadcast_to(poses.T_base_tcp[:, None, :3, :3], commanded.shape)
    np.testing.assert_allclose(commanded, wanted, atol=1e-9)


def test_the_controller_drives_on_into_the_surface_and_the_marker_less_so(exact, poses):
    into = poses.T_base_tcp[:, None, :3, 2]
    controller, marker = (
        np.sum(exact[f"{name}_displacement"].values * into, axis=-1)
        for name in ("controller", "marker")
    )
    np.testing.assert_allclose(marker, 3e-3 + 1100.0 / 4e6, atol=1e-12)
    assert np.all(controller > marker)


def test_the_tool_is_dragged_against_the_lateral_force_and_slips(arm, poses, forces):
    firm = readings(arm, poses, forces, contact=Contact(micro_slip=0.0))
    loose = readings(arm, poses, forces)
    lateral = np.sum(firm["marker_displacement"].values[:, 1] * poses.T_base_tcp[:, :3, 0], axis=-1)
    np.testing.assert_allclose(lateral, -280.0 / 1.5e6, atol=1e-12)
    slip = (loose["marker_displacement"] - firm["marker_displacement"]).values
    assert 5e-6 < slip.std() < 40e-6


def test_noise_has_the_size_stated(arm, linkage, poses, forces):
    noise = Noise(force=5.0, marker=30e-6)
    many = np.tile(poses.joints, (5, 1)), np.tile(forces, (5, 1, 1))
    rng = np.random.default_rng(0)
    data = measure(bearing_truth(linkage), *many, noise, rng).to_xarray()
    calm = measure(bearing_truth(linkage), *many, Noise(), np.random.default_rng(0)).to_xarray()
    assert (data["force"] - calm["force"]).values.std() == pytest.approx(5.0, rel=0.1)
    assert (difference(data) - difference(calm)).std() == pytest.approx(30e-6 * 2**0.5, rel=0.15)
    np.testing.assert_allclose(data["marker_sigma"].values, 30e-6 * 2**0.5)
    np.testing.assert_allclose(data["force_sigma"].values, 5.0)


def test_the_load_cases_of_a_pose_share_the_error_of_its_unloaded_reading(arm, poses, forces):
    noisy, calm = (readings(arm, poses, forces, n) for n in (Noise(marker=1e-4), Noise()))
    error = difference(noisy) - difference(calm)
    assert error.mean(axis=1).std() > 1.5 * 1e-4 / 5**0.5


def test_repeatability_errs_the_controller_and_not_the_marker(arm, poses, forces, exact):
    data = readings(arm, poses, forces, Noise(controller=1e-4))
    np.testing.assert_array_equal(
        data["marker_displacement"].values, exact["marker_displacement"].values
    )
    error = data["controller_displacement"].values - exact["controller_displacement"].values
    assert 5e-5 < error.std() < 3e-4


def test_the_same_seed_gives_the_same_readings_and_another_one_others(arm, poses, forces):
    first, again, other = (readings(arm, poses, forces, SHOP_FLOOR, seed) for seed in (1, 1, 2))
    assert first.identical(again)
    assert np.abs(difference(first) - difference(other)).max() > 1e-5


def test_a_blunder_shifts_one_marker_displacement(arm, poses, forces, exact):
    data = readings(arm, poses, forces, blunders=[Blunder(3, "south", (0.5, 0.0, -0.1))])
    shift = (data["marker_displacement"] - exact["marker_displacement"]).values
    np.testing.assert_allclose(shift[3, 2], [0.5, 0.0, -0.1], atol=1e-12)
    shift[3, 2] = 0.0
    assert not shift.any()


def test_the_dataset_names_its_robot(arm, exact):
    assert exact.attrs["robot_urdf"] == arm.linkage.urdf
    assert exact.attrs["tcp_frame"] == "tcp"
    assert exact["load_case"].values.tolist() == list(LOAD_CASES)
    assert exact["joint"].values.tolist() == ["a1", "a2", "a3", "a4", "a5", "a6"]


@pytest.mark.parametrize(("pose", "load_case"), [(12, "north"), (-1, "north"), (0, "up")])
def test_a_blunder_at_no_reading_is_refused(arm, poses, forces, pose, load_case):
    with pytest.raises(DatasetError, match=f"blunder at pose {pose}, load case '{load_case}'"):
        readings(arm, poses, forces, blunders=[Blunder(pose, load_case, (0.1, 0.0, 0.0))])


def test_forces_that_do_not_fit_the_poses_are_refused(arm, poses, forces):
    with pytest.raises(
        DatasetError, match=r"must be \(pose, joint\) and \(pose, 5 load cases, 3\)"
    ):
        readings(arm, poses, forces[:, :3])


def test_a_load_that_drags_the_tool_out_of_reach_is_refused(arm, poses):
    soft = Contact(normal_stiffness=1e3, shear_stiffness=1e3)
    pull = np.array([[[-4000.0, 0.0, 0.0]]])
    rng = np.random.default_rng(0)
    with pytest.raises(UnreachableError, match="pose 0: the arm cannot follow"):
        measure(arm, poses.joints[:1], pull, Noise(), rng, load_cases=["pull"], contact=soft)
