import numpy as np
import pytest

from elastocal.elastic import ElasticModel, Hinge, layout, spring_torques
from elastocal.errors import RobotError, SpringError
from elastocal.robot import Jacobian, Robot
from elastocal.sim.arm import (
    Linkage,
)
from support.cells import linkage
from support.geared import geared, heavy_robot
from support.problems import elastic
from support.virtual_chain import ARMS, configurations, numerical_column

URDF = ARMS["offset wrist"]
LINKAGE = Linkage.from_urdf(URDF, "tcp")
Q = configurations(LINKAGE, 6)
RNG = np.random.default_rng(1)
FORCE, MOMENT = RNG.normal(0.0, 500.0, (6, 3)), RNG.normal(0.0, 100.0, (6, 3))
C = RNG.uniform(1e-7, 1e-5, 18)


@pytest.fixture(scope="module")
def model():
    robot = Robot.from_urdf(URDF, "tcp")
    return ElasticModel(robot, layout(robot, "bearing"))


def test_deflection_is_observation_times_compliance_and_compliance_times_force(model):
    deflection = model.deflection(C, Q, FORCE)
    np.testing.assert_array_equal(deflection, model.observation_blocks(Q, FORCE) @ C)
    matrix = model.cartesian_compliance(C, Q).translation
    np.testing.assert_allclose(deflection, (matrix @ FORCE[..., None])[..., 0], rtol=1e-10)


def test_pushing_deflects_along_the_push(model):
    """Compliances are positive: the work of the force on the robot is, too (spec section 1)."""
    work = np.sum(model.deflection(C, Q, FORCE) * FORCE, axis=-1)
    assert np.all(work > 0.0)


def test_twice_the_deflection_work_is_the_energy_in_the_springs(model):
    torques = spring_torques(model.spring_jacobian(Q), FORCE)
    work = np.sum(model.deflection(C, Q, FORCE) * FORCE, axis=-1)
    np.testing.assert_allclose(work, np.square(torques) @ C, rtol=1e-12)


def test_a_moment_deflects_as_coupling_says(model):
    compliance = model.cartesian_compliance(C, Q)
    expected = (compliance.coupling @ MOMENT[..., None])[..., 0]
    found = model.deflection(C, Q, FORCE, MOMENT) - model.deflection(C, Q, FORCE)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


def test_a_force_beside_the_tcp_is_the_force_with_its_moment():
    """Virtual work: the torques are those of the same force at a tcp moved there."""
    moved = URDF.replace('xyz="0.0 0.0 0.215"', 'xyz="0.12 -0.2 0.515"')
    assert moved != URDF
    here, there = (Robot.from_urdf(text, "tcp") for text in (URDF, moved))
    lever = there.forward(Q)[:, :3, 3] - here.forward(Q)[:, :3, 3]
    assert np.allclose(np.linalg.norm(lever, axis=1), np.linalg.norm([0.12, -0.2, 0.3]))
    springs = layout(here, "bearing")
    expected = spring_torques(ElasticModel(there, springs).spring_jacobian(Q), FORCE)
    found = spring_torques(
        ElasticModel(here, springs).spring_jacobian(Q), FORCE, np.cross(lever, FORCE)
    )
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_reciprocity_of_force_and_moment(model):
    """Betti: the work of a moment over a force's rotation is that of the force over its shift."""
    found = model.cartesian_compliance(C, Q)
    turn_by_force = (np.swapaxes(found.coupling, 1, 2) @ FORCE[..., None])[..., 0]
    shift_by_moment = (found.coupling @ MOMENT[..., None])[..., 0]
    np.testing.assert_allclose(
        np.sum(turn_by_force * MOMENT, axis=1), np.sum(shift_by_moment * FORCE, axis=1), rtol=1e-9
    )


def test_load_cases_are_broadcast_over_a_pose(model):
    cases = RNG.normal(0.0, 500.0, (6, 5, 3))
    together = model.observation_blocks(Q[:, None], cases)
    one_by_one = [[model.observation_blocks(q, f) for f in row] for q, row in zip(Q, cases)]  # noqa: B905
    assert together.shape == (6, 5, 3, 18)
    np.testing.assert_allclose(together, one_by_one, rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(model.observation_blocks(Q[0], cases[0]), together[0])
    repeated = np.repeat(Q[:, None], 5, axis=1)
    np.testing.assert_allclose(model.observation_blocks(repeated, cases), together, rtol=1e-13)


def test_the_cartesian_compliance_of_hinges_is_the_papers_sum(model):
    """``J diag(c) J^T`` and likewise (paper Eq. 10), whatever the load."""
    found = model.cartesian_compliance(C, Q, FORCE, MOMENT)
    J, W = model.spring_jacobian(Q).translation, model.spring_jacobian(Q).rotation
    for part, left, right in (
        (found.translation, J, J),
        (found.rotation, W, W),
        (found.coupling, J, W),
    ):
        np.testing.assert_allclose(part, (left * C) @ np.swapaxes(right, 1, 2), atol=1e-18)


NAMED = {
    "force": lambda model, value: model.observation_blocks(Q, value),
    "moment": lambda model, value: model.observation_blocks(Q, FORCE, value),
    "marker_offset": lambda model, value: model.observation_blocks(Q, FORCE, None, value),
    "direction": lambda model, value: model.directional_rows(Q, value),
    "force ": lambda model, value: model.cartesian_compliance(C, Q, value),
    "moment ": lambda model, value: model.cartesian_compliance(C, Q, FORCE, value),
    "moment  ": lambda model, value: model.load_torques(Q, FORCE, value),
}


@pytest.mark.parametrize("name", NAMED)
@pytest.mark.parametrize(
    ("value", "message"),
    [([0.0, np.nan, 0.0], "not finite"), ([1.0, 2.0], r"shape \(2,\).*x, y, z")],
)
def test_vectors_that_are_none_are_refused_by_name(model, name, value, message):
    with pytest.raises(SpringError, match=rf"^{name.strip()} .*{message}"):
        NAMED[name](model, value)


def test_the_sag_of_a_marker_is_that_of_its_own_point():
    robot = heavy_robot()
    heavy = ElasticModel(robot, layout(robot, "bearing"))
    offset = np.array([0.1, -0.05, 0.3])
    rows = heavy.sag_blocks(Q, offset)
    for q, torque, row in zip(Q, heavy.weight_torques(Q), rows, strict=True):
        moved = [numerical_column(linkage(), q, spring, offset)[0] for spring in heavy.springs]
        expected = np.transpose(moved) * torque
        np.testing.assert_allclose(row, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())


def test_a_marker_at_the_tcp_gives_the_rows_of_the_tcp(model):
    expected = model.observation_blocks(Q, FORCE, MOMENT)
    for offset in (None, np.zeros(3)):
        np.testing.assert_array_equal(model.observation_blocks(Q, FORCE, MOMENT, offset), expected)


def test_a_marker_beside_the_tcp_shows_the_displacement_of_its_own_point(model):
    offset = np.array([0.1, -0.05, 0.3])
    jacobian = model.spring_jacobian(Q)
    torques = spring_torques(jacobian, FORCE, MOMENT)
    rows = model.observation_blocks(Q, FORCE, MOMENT, offset)
    for q, torque, row in zip(Q, torques, rows, strict=True):
        moved = [numerical_column(LINKAGE, q, spring, offset)[0] for spring in model.springs]
        np.testing.assert_allclose(row, np.transpose(moved) * torque, rtol=1e-7, atol=1e-5)


def test_broadcast_load_cases_and_a_marker_go_together(model):
    cases, offset = RNG.normal(0.0, 500.0, (6, 5, 3)), [0.0, 0.2, 0.1]
    together = model.observation_blocks(Q[:, None], cases, marker_offset=offset)
    alone = model.observation_blocks(Q[2], cases[2, 3], marker_offset=offset)
    np.testing.assert_allclose(together[2, 3], alone, rtol=1e-12, atol=1e-12)


def test_a_distal_spring_turns_with_its_joint_and_a_proximal_one_does_not(model):
    robot = model.robot
    at = [
        ElasticModel(robot, (Hinge("s", "joint_1", (1.0, 0.0, 0.0), distal=distal),))
        for distal in (False, True)
    ]
    q = np.array([0.7, 0.1, 0.2, 0.3, 0.4, 0.5])
    proximal, distal = (model.spring_jacobian(q).rotation[:, 0] for model in at)
    np.testing.assert_allclose(proximal, [1.0, 0.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(distal, [np.cos(0.7), np.sin(0.7), 0.0], atol=1e-15)


def test_a_prismatic_spring_moves_the_tcp_along_its_axis_wherever_it_sits(model):
    axis = (0.0, 0.6, 0.8)
    springs = [
        Hinge("here", "joint_1", axis, revolute=False),
        Hinge("there", "joint_1", axis, revolute=False, offset=(1.0, 2.0, 3.0)),
    ]
    found = ElasticModel(model.robot, springs).spring_jacobian(Q)
    np.testing.assert_allclose(found.translation, np.tile(np.transpose([axis] * 2), (6, 1, 1)))
    np.testing.assert_allclose(found.rotation, 0.0, atol=1e-15)


def test_the_torque_of_a_force_through_the_axis_is_zero():
    column = np.array([[0.0], [0.0], [0.0]])
    jacobian = Jacobian(column, np.array([[0.0], [0.0], [1.0]]))
    assert spring_torques(jacobian, [3.0, 4.0, 5.0]) == pytest.approx(0.0)
    assert spring_torques(jacobian, [3.0, 4.0, 5.0], [0.0, 0.0, 7.0]) == pytest.approx(7.0)


def test_a_compliance_that_is_not_finite_is_named(model):
    c = np.ones(18)
    c[2] = np.nan
    with pytest.raises(SpringError, match=f"compliance of {model.parameter_names[2]} is nan"):
        model.deflection(c, Q, FORCE)


@pytest.mark.parametrize(
    "wrong", [{"joint_a1": 1e-6}, "home", 1j * np.ones(18), [[1.0], [1.0, 2.0]]]
)
def test_what_is_no_array_of_real_numbers_is_named(model, wrong):
    with pytest.raises(TypeError, match=r"^compliances is .*allowed: real numbers"):
        model.deflection(wrong, Q, FORCE)
    with pytest.raises(TypeError, match=r"^joint positions is .*allowed: real numbers"):
        model.deflection(np.ones(18), wrong, FORCE)
    with pytest.raises(TypeError, match=r"^force is .*allowed: real numbers"):
        model.deflection(np.ones(18), Q, wrong)


@pytest.mark.parametrize("c", [np.ones(17), 1.0, np.ones((18, 1))])
def test_compliances_of_another_shape_are_refused(model, c):
    with pytest.raises(SpringError, match=r"18 finite numbers, one a spring, got shape \("):
        model.deflection(c, Q, FORCE)


def test_compliances_are_asked_for_by_the_parameter_where_springs_have_several():
    with pytest.raises(SpringError, match=r"42 finite numbers, one a parameter, got shape \(18,\)"):
        geared().model.deflection(C, Q, FORCE)


@pytest.mark.parametrize("q", [np.zeros(5), np.full(6, np.nan), 0.0])
def test_joints_of_another_shape_or_not_finite_are_refused(model, q):
    with pytest.raises(RobotError, match="joint positions"):
        model.observation_blocks(q, [1.0, 2.0, 3.0])


def test_springs_are_kept_in_the_order_given():
    springs = elastic("bearing").springs[::-1]
    model = ElasticModel(elastic("bearing").robot, list(springs))
    assert model.springs == springs
    assert model.spring_names == tuple(spring.name for spring in springs)
    np.testing.assert_allclose(
        model.spring_jacobian(Q).translation,
        elastic("bearing").spring_jacobian(Q).translation[..., ::-1],
        atol=1e-14,
    )
