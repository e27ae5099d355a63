import numpy as np
import pytest

from elastocal.errors import SpringError
from elastocal.sim.arm import (
    AXIAL_STIFFNESS,
    LINK_BENDING,
    Linear,
    bearing_truth,
    with_link_bending,
    with_stiffening_gears,
)
from elastocal.sim.arm.gears import StiffeningGear


def norms(arm, poses, forces):
    return np.linalg.norm(arm.equilibrium(poses.joints[:, None], forces).deflection, axis=-1)


def test_bearing_has_an_axial_hinge_and_two_tilts_at_every_joint(linkage):
    arm = bearing_truth(linkage)
    assert [spring.joint for spring in arm.springs] == [f"a{j}" for j in range(1, 7) for _ in "xyz"]
    assert [spring.axis for spring in arm.springs[3:6]] == [(0, 1, 0), (1, 0, 0), (0, 0, 1)]
    assert not any(spring.distal for spring in arm.springs)


def test_tilts_of_a_skew_axis_are_orthonormal_to_it(mixed):
    springs = bearing_truth(mixed, [1e6] * 4, np.full((4, 2), 1e6)).springs[3:6]
    axes = np.array([spring.axis for spring in springs])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)


def test_a_prismatic_joint_gives_along_its_axis(mixed):
    springs = bearing_truth(mixed, [1e6] * 4).springs
    assert [spring.revolute for spring in springs[:3]] == [False, True, True]


def test_stiffnesses_are_those_given(linkage):
    tilts = np.arange(1.0, 13.0).reshape(6, 2)
    springs = bearing_truth(linkage, AXIAL_STIFFNESS, tilts).springs
    assert [spring.law.k for spring in springs[::3]] == list(AXIAL_STIFFNESS)
    assert [spring.law.k for spring in springs[16:]] == [11.0, 12.0]


def test_the_tcp_deflects_as_much_as_a_one_tonne_robot_does(linkage, poses, forces):
    deflection = norms(bearing_truth(linkage), poses, forces)
    assert 0.5e-3 < np.median(deflection) < 2.5e-3
    assert deflection.min() > 0.1e-3
    assert deflection.max() < 3.5e-3


def test_stiffening_gears_lower_every_deflection_a_little(linkage, poses, forces):
    arm = bearing_truth(linkage)
    ratio = norms(with_stiffening_gears(arm), poses, forces) / norms(arm, poses, forces)
    assert 0.7 < ratio.min() < 0.99
    assert ratio.max() < 1.0


def test_stiffening_gears_answer_small_loads_like_linear_ones(linkage, poses, forces):
    arm = bearing_truth(linkage)
    linear, gear = (norms(a, poses, 1e-2 * forces) for a in (arm, with_stiffening_gears(arm)))
    np.testing.assert_allclose(gear, linear, rtol=1e-3)


def test_only_the_gears_named_stiffen_and_no_tilt_does(linkage):
    arm = with_stiffening_gears(bearing_truth(linkage), 0.3, ["a2", "a4"])
    gears = [i for i, spring in enumerate(arm.springs) if isinstance(spring.law, StiffeningGear)]
    assert gears == [3, 9]


def test_link_bending_raises_the_deflection(linkage, poses, forces):
    arm = bearing_truth(linkage)
    bent = with_link_bending(arm, {"a2": LINK_BENDING, "a3": LINK_BENDING})
    assert len(bent.springs) == 22
    assert norms(bent, poses, forces).mean() > 1.05 * norms(arm, poses, forces).mean()


def test_no_springs_at_the_joints_explain_link_bending(linkage, poses, forces):
    """Least squares of the 18 compliances: exact for the bearing arm, not for the bent one."""
    arm = bearing_truth(linkage)
    bent = with_link_bending(arm, {"a2": 2e6, "a3": 2e6})
    small = 1e-3 * forces
    rest = linkage.forward(poses.joints)[:, :3, 3]
    tilts = 1e-6 * np.eye(18)
    moved = [arm.tcp_position(poses.joints, np.tile(t, (len(rest), 1))) - rest for t in tilts]
    J = np.stack(moved, axis=-1)[:, None] / 1e-6
    rows = (J * np.einsum("plis,pli->pls", J, small)[:, :, None]).reshape(-1, 18)

    def unexplained(truth):
        d = truth.equilibrium(poses.joints[:, None], small).deflection.ravel()
        c = np.linalg.lstsq(rows, d, rcond=1e-9)[0]
        return np.linalg.norm(rows @ c - d) / np.linalg.norm(d)

    assert unexplained(arm) < 1e-4
    assert unexplained(bent) > 10 * unexplained(arm)
    assert unexplained(bent) > 5e-3


def test_a_flexure_sits_on_the_way_to_the_next_joint(linkage):
    bent = with_link_bending(bearing_truth(linkage), {"a3": 1e6}, fraction=0.25)
    hinges = [spring for spring in bent.springs if spring.distal]
    assert [spring.law for spring in hinges] == [Linear(1e6)] * 2
    np.testing.assert_allclose(hinges[0].at, 0.25 * np.array([1.22, 0.0, -0.115]), atol=1e-15)
    for hinge in hinges:
        assert abs(np.dot(hinge.axis, hinge.at)) < 1e-15


@pytest.mark.parametrize("joint", ["a4", "a6"])
def test_a_link_without_length_cannot_bend(linkage, joint):
    with pytest.raises(SpringError, match=f"behind joint '{joint}' has no length"):
        with_link_bending(bearing_truth(linkage), {joint: 1e6})


def test_unknown_joints_are_refused(linkage):
    arm = bearing_truth(linkage)
    with pytest.raises(SpringError, match="no joint 'a9'"):
        with_stiffening_gears(arm, joints=["a9"])
    with pytest.raises(SpringError, match="no joint 'aa2'; did you mean 'a2'"):
        with_link_bending(arm, {"aa2": 1e6})


def test_stiffnesses_of_the_wrong_shape_are_refused(linkage):
    with pytest.raises(SpringError, match=r"axial stiffness has shape \(5,\), must be \(6,\)"):
        bearing_truth(linkage, [1e6] * 5, np.ones((6, 2)))
    with pytest.raises(SpringError, match=r"transverse stiffness has shape \(6,\)"):
        bearing_truth(linkage, [1e6] * 6, np.ones(6))
