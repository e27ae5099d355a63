"""The rigid robot: derivatives by finite differences, golden numbers, refusals."""

import json

import numpy as np
import pinocchio as pin
import pytest

from elastocal.errors import FileAccessError, RobotError
from elastocal.files import sha256
from elastocal.robot import GRAVITY, InsertedJoint, Rail, Robot, build_model, catalogue, on_rail
from support.shared import GOLDEN, needs_shared
from support.urdfs import FLOOR, KR_LIKE, WALL, opw_arm_urdf

ARMS = {
    "arm": Robot.from_urdf(opw_arm_urdf(**KR_LIKE), "tcp"),
    "arm with rail and table on a wall": Robot.from_urdf(
        opw_arm_urdf(**KR_LIKE, rail=(0.0, 2.0), turntable=(-1.0, 1.0), mount=WALL), "tcp"
    ),
    "KUKA": catalogue.load("KR 210 R2700-2"),
}
every_arm = pytest.mark.parametrize("robot", ARMS.values(), ids=ARMS.keys())


def configurations(robot: Robot, count: int) -> np.ndarray:
    """Return joint positions (count, joint) within a turn."""
    rng = np.random.default_rng(11)
    return rng.uniform(-1.5, 1.5, (count, len(robot.joint_names)))


def derivative(function, q: np.ndarray, step: float = 1e-6) -> np.ndarray:
    """Return the central differences of a function, the joint as last axis."""
    steps = step * np.eye(len(q))
    return np.stack([(function(q + s) - function(q - s)) / (2 * step) for s in steps], axis=-1)


class TestKinematics:
    @every_arm
    def test_translation_jacobian_is_the_derivative_of_the_position(self, robot):
        for q in configurations(robot, 5):
            by_differences = derivative(lambda q: robot.forward(q)[:3, 3], q)
            np.testing.assert_allclose(robot.jacobian(q).translation, by_differences, atol=1e-8)

    @every_arm
    def test_rotation_jacobian_is_the_angular_velocity_in_base_axes(self, robot):
        for q in configurations(robot, 5):
            R = robot.forward(q)[:3, :3]
            turn = derivative(lambda q: robot.forward(q)[:3, :3], q)
            spin = np.einsum("ijk,lj->ilk", turn, R)
            angular = np.stack([spin[2, 1], spin[0, 2], spin[1, 0]])
            np.testing.assert_allclose(robot.jacobian(q).rotation, angular, atol=1e-8)

    @every_arm
    def test_many_poses_at_once_are_the_single_ones_stacked(self, robot):
        q = configurations(robot, 6).reshape(2, 3, -1)
        T, J = robot.forward(q), robot.jacobian(q)
        assert T.shape == (2, 3, 4, 4)
        assert J.translation.shape == J.rotation.shape == (2, 3, 3, q.shape[-1])
        np.testing.assert_array_equal(T[1, 2], robot.forward(q[1, 2]))
        np.testing.assert_array_equal(J.translation[1, 2], robot.jacobian(q[1, 2]).translation)

    def test_joints_before_the_last_six_are_external(self):
        assert [robot.external_axes for robot in ARMS.values()] == [0, 2, 0]
        rail = ARMS["arm with rail and table on a wall"]
        assert rail.revolute == (False, *[True] * 7)

    @pytest.mark.parametrize("distal", [False, True])
    @pytest.mark.parametrize("parent", range(6))
    def test_virtual_joint_at_zero_leaves_the_robot_as_it_is(self, parent, distal):
        robot = ARMS["KUKA"]
        assert_same_robot(robot, [virtual_joint("v", parent, distal, (0.0, 0.0, 0.0))])

    @pytest.mark.parametrize(
        ("parent", "distal"), [*((parent, False) for parent in range(6)), (5, True)]
    )
    def test_offset_of_a_virtual_joint_displaces_nothing_behind_it(self, parent, distal):
        first = virtual_joint("v", parent, distal, (0.1, -0.2, 0.3))
        second = virtual_joint("w", parent, distal, (-0.3, 0.0, 0.2))
        assert_same_robot(ARMS["KUKA"], [first, second])

    @pytest.mark.parametrize("parent", range(5))
    def test_offset_of_a_distal_virtual_joint_displaces_no_later_joint(self, parent):
        assert_same_robot(ARMS["KUKA"], [virtual_joint("v", parent, True, (0.1, -0.2, 0.3))])


def virtual_joint(
    name: str, parent: int, distal: bool, offset: tuple[float, float, float]
) -> InsertedJoint:
    return InsertedJoint(name, parent, np.array([1.0, 0.0, 0.0]), True, distal, np.array(offset))


def assert_same_robot(robot: Robot, inserted: list[InsertedJoint]) -> None:
    """Check pose and gravity torques with the virtual joints at zero."""
    soft = build_model(robot.chain, inserted)
    soft.model.gravity.linear = np.array(GRAVITY)
    q = configurations(robot, 1)[0]
    full = np.zeros(soft.model.nq)
    full[soft.joint_columns] = q
    data = soft.model.createData()
    pin.framesForwardKinematics(soft.model, data, full)
    tip = data.oMf[soft.tip_frame].homogeneous
    np.testing.assert_allclose(tip, robot.forward(q), atol=1e-14)
    torques = pin.computeGeneralizedGravity(soft.model, data, full)[soft.joint_columns]
    np.testing.assert_allclose(torques, robot.gravity_torques(q), rtol=1e-12, atol=1e-9)


class TestGravity:
    def test_torques_are_the_gradient_of_the_potential_energy(self):
        robot = ARMS["KUKA"]
        model = pin.buildModelFromXML(robot.urdf)
        model.gravity.linear = np.array(GRAVITY)
        data = model.createData()
        for q in configurations(robot, 5):
            slope = derivative(lambda q: pin.computePotentialEnergy(model, data, q), q)
            np.testing.assert_allclose(robot.gravity_torques(q), slope, atol=1e-4)

    def test_stretched_arm_is_held_by_the_sum_of_its_moments(self):
        robot = ARMS["KUKA"]
        links = catalogue.entry("KR 210 R2700-2").inertia.links
        arm = catalogue.entry("KR 210 R2700-2").dimensions
        wrist = arm.c2 + arm.c3
        start = {"link_2": 0.0, "link_3": arm.c2, "link_4": wrist, "link_5": wrist, "link_6": wrist}
        moment = sum(links[n].mass * (x + links[n].centre[0]) for n, x in start.items())
        # Positive A2 lowers the arm, so what holds it up is negative.
        expected = GRAVITY[2] * moment
        assert robot.gravity_torques(np.zeros(6))[1] == pytest.approx(expected, rel=1e-12)

    def test_gravity_along_a_rail_is_the_weight_of_all_that_it_carries(self):
        robot = Robot.from_urdf(on_rail(ARMS["KUKA"].urdf, Rail("e1", [1, 0, 0], 0, 3)), "flange")
        mass = sum(link.mass for link in catalogue.entry("KR 210 R2700-2").inertia.links.values())
        force = robot.gravity_torques(np.zeros(7), gravity=(-2.0, 0.0, 0.0))[0]
        assert force == pytest.approx(2.0 * mass, rel=1e-12)

    def test_gravity_of_one_call_does_not_stay_for_the_next(self):
        robot, q = ARMS["KUKA"], np.full(6, 0.3)
        before = robot.gravity_torques(q)
        robot.gravity_torques(q, gravity=(1.0, 2.0, 3.0))
        np.testing.assert_array_equal(robot.gravity_torques(q), before)

    def test_many_poses_at_once(self):
        robot = ARMS["KUKA"]
        q = configurations(robot, 4).reshape(2, 2, 6)
        np.testing.assert_array_equal(
            robot.gravity_torques(q)[1, 0], robot.gravity_torques(q[1, 0])
        )

    def test_robot_without_masses_has_no_gravity_torques(self):
        with pytest.raises(RobotError, match="robot 'arm' has no link masses"):
            ARMS["arm"].gravity_torques(np.zeros(6))


class TestDescription:
    def test_margin_is_to_the_nearer_limit_and_negative_outside(self):
        limits = ARMS["KUKA"].limits
        q = np.radians([0.0, -10.0, 100.0, 0.0, -130.0, 0.0])
        np.testing.assert_allclose(np.degrees(limits.margin(q)), [185, 5, 68, 350, -5, 350])

    def test_robot_remembers_the_text_it_was_made_from(self, tmp_path):
        text = opw_arm_urdf(**KR_LIKE, mount=FLOOR)
        file = tmp_path / "arm.urdf"
        file.write_text(text, encoding="utf-8")
        robot = Robot.from_file(file, "tcp")
        assert (robot.name, robot.base, robot.tip) == ("arm", "base", "tcp")
        assert (robot.urdf, robot.urdf_hash) == (text, sha256(text))
        assert robot.assumptions == ()

    def test_missing_file_is_refused_by_name(self, tmp_path):
        with pytest.raises(FileAccessError, match=r"cannot read .*none\.urdf"):
            Robot.from_file(tmp_path / "none.urdf", "tcp")

    def test_the_text_of_a_urdf_in_place_of_its_file_is_refused_in_one_short_line(self):
        with pytest.raises(RobotError, match=r"Robot\.from_urdf reads a text") as refused:
            Robot.from_file(opw_arm_urdf(**KR_LIKE, mount=FLOOR), "tcp")
        assert len(str(refused.value)) < 100


class TestRefusals:
    @pytest.mark.parametrize("q", [0.0, [], np.zeros(5), np.zeros((6, 7))])
    @pytest.mark.parametrize("method", ["forward", "jacobian", "gravity_torques"])
    def test_wrong_number_of_joints_is_refused_with_their_names(self, method, q):
        with pytest.raises(RobotError, match=r"must be the 6 joints of KR 210 R2700-2 \(joint_a1"):
            getattr(ARMS["KUKA"], method)(q)

    @pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
    @pytest.mark.parametrize("method", ["forward", "jacobian", "gravity_torques"])
    def test_position_that_is_not_finite_is_refused(self, method, value):
        with pytest.raises(RobotError, match="hold a value that is not finite"):
            getattr(ARMS["KUKA"], method)([0.0, 0.0, 0.0, value, 0.0, 0.0])


@pytest.fixture(scope="module")
def golden() -> dict[str, np.ndarray]:
    """Return the arrays of the golden file by name."""
    data = json.loads((GOLDEN / "golden_6r.json").read_text())
    names = ("joint_position", "tcp_position", "tcp_rotation", "spring_jacobian")
    return {name: np.array(data[name]) for name in names}


@needs_shared
class TestGolden:
    """Numbers of an independent implementation (shared/data/golden_6r)."""

    def test_poses_agree(self, golden):
        T = Robot.from_file(GOLDEN / "golden_6r.urdf", "tcp").forward(golden["joint_position"])
        np.testing.assert_allclose(T[:, :3, 3], golden["tcp_position"], atol=1e-12)
        np.testing.assert_allclose(T[:, :3, :3], golden["tcp_rotation"], atol=1e-12)

    def test_jacobian_columns_agree(self, golden):
        robot = Robot.from_file(GOLDEN / "golden_6r.urdf", "tcp")
        J = robot.jacobian(golden["joint_position"]).translation
        np.testing.assert_allclose(J, golden["spring_jacobian"][..., :6], atol=1e-12)

    def test_catalogue_shares_its_zero_pose_and_signs(self, golden):
        ours = catalogue.load("KR 120 R2700 extra HA", tip="link_6")
        theirs = Robot.from_file(GOLDEN / "golden_6r.urdf", "link_6")
        q = golden["joint_position"]
        np.testing.assert_allclose(ours.forward(q), theirs.forward(q), atol=1e-12)


def test_every_robot_of_the_catalogue_shows_itself_in_a_few_lines():
    for name in catalogue.names():
        robot = catalogue.load(name)
        shown = repr(robot)
        assert name in shown
        assert f"{robot.joint_names[-1]}: " in shown
        assert len(shown.splitlines()) <= 20
