"""URDFs as people publish them: shapes seen in public descriptions, made here from parameters.

Each shape is an arm (axes, origins, names) and what its authors put around it; nothing is copied.
What comes out is held against the product of transforms that the parameters give.
"""

import math
from dataclasses import dataclass, field

import numpy as np
import pytest

from elastocal.errors import FileAccessError, RobotError
from elastocal.robot import Robot, collision_model, find_meshes, tip_links, tool_link
from elastocal.robot.inverse import inverse_for, joints_along_path
from elastocal.robot.urdf import parse_urdf
from elastocal.workflows import check

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
DOWN = (0.0, 0.0, -1.0)
QUARTER = math.pi / 2
STEPS = ((0, 0, 0.4), (0.1, 0, 0.2), (0, 0, 0.7), (0.02, 0, 0.1), (0.6, 0, 0), (0.09, 0, 0))


def minus(axis):
    return tuple(-value for value in axis)


@dataclass(frozen=True)
class Arm:
    """A chain: one axis, origin, turn and kind a joint, and the tool behind the last."""

    axes: tuple = (Z, Y, Y, X, Y, X)
    steps: tuple = STEPS
    turns: tuple = ()
    kinds: str = "rrrrrr"
    tool: tuple = ((0.0, 0.0, 0.0), (0.0, QUARTER, 0.0))

    def parts(self):
        turns = self.turns or ((0.0, 0.0, 0.0),) * len(self.axes)
        return list(zip(self.kinds, self.axes, self.steps, turns, strict=True))

    def forward(self, q):
        """The independent product of transforms."""
        T = np.eye(4)
        for (kind, axis, step, turn), value in zip(self.parts(), q, strict=True):
            T = T @ placed(step, turn) @ moved(kind, np.array(axis), value)
        return T @ placed(*self.tool)


def about(axis, angle):
    x, y, z = axis / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K


def placed(step, turn):
    T = np.eye(4)
    roll, pitch, yaw = turn
    T[:3, :3] = about(np.array(Z), yaw) @ about(np.array(Y), pitch) @ about(np.array(X), roll)
    T[:3, 3] = step
    return T


def moved(kind, axis, value):
    T = np.eye(4)
    if kind == "p":
        T[:3, 3] = value * axis / np.linalg.norm(axis)
    else:
        T[:3, :3] = about(axis, value)
    return T


ABB = Arm()
KUKA = Arm((DOWN, Y, Y, minus(X), Y, minus(X)))
FANUC = Arm(
    (Z, Y, minus(Y), minus(X), minus(Y), minus(X)), tool=((0, 0, 0), (math.pi, -QUARTER, 0))
)
UR = Arm(
    (Z,) * 6,
    ((0, 0, 0.16), (0, 0, 0), (-0.6, 0, 0), (-0.57, 0, 0.17), (0, -0.12, 0), (0, 0.116, 0)),
    (
        (0, 0, 0),
        (QUARTER, 0, 0),
        (0, 0, 0),
        (0, 0, 0),
        (QUARTER, 0, 0),
        (QUARTER, 3.14159, 3.14159),
    ),
)
SEVEN_STEPS = (*STEPS[:3], (0.05, 0, 0.2), (0, 0, 0.2), *STEPS[4:])
IIWA = Arm(
    (Z,) * 7,
    (
        (0, 0, 0.15),
        (0, 0, 0.19),
        (0, 0.21, 0),
        (0, 0, 0.19),
        (0, 0.21, 0),
        (0, 0.06, 0.19),
        (0, 0.08, 0.06),
    ),
    (
        (0, 0, 0),
        (QUARTER, 0, math.pi),
        (QUARTER, 0, math.pi),
        (QUARTER, 0, 0),
        (-QUARTER, math.pi, 0),
        (QUARTER, 0, 0),
        (-QUARTER, math.pi, 0),
    ),
    "rrrrrrr",
)
FRANKA = Arm(
    (Z,) * 7,
    (
        (0, 0, 0.333),
        (0, 0, 0),
        (0, -0.316, 0),
        (0.0825, 0, 0),
        (-0.0825, 0.384, 0),
        (0, 0, 0),
        (0.088, 0, 0),
    ),
    (
        (0, 0, 0),
        (-QUARTER, 0, 0),
        (QUARTER, 0, 0),
        (QUARTER, 0, 0),
        (-QUARTER, 0, 0),
        (QUARTER, 0, 0),
        (QUARTER, 0, 0),
    ),
    "rrrrrrr",
    ((0, 0, 0.107), (0, 0, 0)),
)
SIA = Arm((Z, Y, Z, minus(Y), minus(Z), minus(Y), minus(Z)), SEVEN_STEPS, kinds="rrrrrrr")
ON_RAIL = Arm((Y, *ABB.axes), ((0, 0, 0.5), *STEPS), kinds="prrrrrr")
ON_TABLE = Arm((Z, *ABB.axes), ((0.3, 0, 0.5), *STEPS), kinds="rrrrrrr")
GANTRY = Arm((X, Y, DOWN, Z, Y, Z), kinds="ppprrr")
SCARA = Arm((Z, Z, DOWN, Z), STEPS[:4], kinds="rrpr")
FOUR = Arm((Z, Y, Y, DOWN), STEPS[:4], kinds="rrrr")
FIVE = Arm((Z, Y, Y, Y, X), STEPS[:5], kinds="rrrrr")
TILTED = Arm((Z, (0.0, 0.6, 0.8), Y, (1.0, 1.0, 0.0), Y, X))


def link(name, inner=""):
    return f'<link name="{name}">{inner}</link>'


def fixed(name, parent, child, inner="", xyz="0 0 0", rpy="0 0 0"):
    return (
        f'<joint name="{name}" type="fixed"><origin xyz="{xyz}" rpy="{rpy}"/>'
        f'<parent link="{parent}"/><child link="{child}"/>{inner}</joint>'
    )


def beside(kind, name, parent, child, inner=""):
    """A joint beside the chain, as its author left it."""
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{inner}</joint>'


def mesh(file, what="collision"):
    return f'<{what}><geometry><mesh filename="{file}"/></geometry></{what}>'


def mass(value, inner='<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'):
    return f'<inertial><origin xyz="0 0 0.1"/><mass value="{value}"/>{inner}</inertial>'


LIMIT = '<limit effort="{effort}" lower="-3" upper="3" velocity="2"/>'
MIMIC = '<axis xyz="0 1 0"/>' + LIMIT.format(effort=0) + '<mimic joint="joint_2"/>'
BASE = link("base") + fixed("base_link-base", "base_link", "base", xyz="0 0 0.4")
NO_AXIS = '<axis xyz="0 0 0"/>'


@dataclass(frozen=True)
class Shape:
    """An arm, and how its description is written."""

    arm: Arm = ABB
    joint: str = "joint_{}"
    link: str = "link_{}"
    root: str = "base_link"
    tip: str = "tool0"
    limit: str = LIMIT
    inner: str = ""
    """Of every link."""
    extra: str = BASE
    head: str = '<?xml version="1.0" ?>\n'
    attributes: str = 'name="arm"'
    continuous: bool = False
    external: int = 0
    tool_joint: str = ""
    encoding: str = "utf-8"
    edit: tuple = ()
    tips: tuple | None = field(default=None)

    def text(self):
        parts, parent = [link(self.root, self.inner)], self.root
        for number, (kind, axis, step, turn) in enumerate(self.arm.parts(), 1):
            child = self.link.format(number)
            type_ = "prismatic" if kind == "p" else "continuous" if self.continuous else "revolute"
            parts += [
                link(child, self.inner),
                f'<joint name="{self.joint.format(number)}" type="{type_}">'
                f'<origin rpy="{spaced(turn)}" xyz="{spaced(step)}"/><parent link="{parent}"/>'
                f'<child link="{child}"/><axis xyz="{spaced(axis)}"/>{self.limit.format(effort=0)}'
                "</joint>",
            ]
            parent = child
        step, turn = self.arm.tool
        parts += [
            link(self.tip),
            fixed("tool", parent, self.tip, self.tool_joint, spaced(step), spaced(turn)),
        ]
        text = f"{self.head}<robot {self.attributes}>{''.join(parts)}{self.extra}</robot>"
        for old, new in self.edit:
            assert old in text
            text = text.replace(old, new)
        return text


def spaced(values):
    return " ".join(repr(float(value)) for value in values)


def twins(*names, last="link_6"):
    return BASE + "".join(link(name) + fixed(f"{last}-{name}", last, name) for name in names)


def hand(last, *, mimics):
    fingers = "".join(
        link(f"finger_{n}")
        + beside(
            "prismatic",
            f"finger_joint_{n}",
            "hand",
            f"finger_{n}",
            '<axis xyz="0 1 0"/><limit effort="20" lower="0" upper="0.04" velocity="0.2"/>'
            + ('<mimic joint="finger_joint_1"/>' if mimics and n == 2 else ""),
        )
        for n in (1, 2)
    )
    return link("hand") + fixed("hand_joint", last, "hand", NO_AXIS) + fingers


SHAPES = {
    # axes, as the makers count them
    "zero frame beside the base, abb": Shape(),
    "clockwise axes, kuka": Shape(KUKA, "joint_a{}"),
    "elbow and wrist turned, fanuc": Shape(FANUC),
    "all axes z, origins turned, universal robots": Shape(UR, "arm_{}_joint", "arm_{}_link"),
    "letters as names, motoman": Shape(FANUC, "joint_{}_s", "link_{}_s"),
    "axes off the frame's own, not of unit length": Shape(TILTED),
    "four axes, palletizer": Shape(FOUR),
    "five axes": Shape(FIVE),
    "scara": Shape(SCARA),
    "gantry": Shape(GANTRY),
    # seven axes
    "seven axes, iiwa": Shape(IIWA, "joint_a{}"),
    "seven axes, franka": Shape(FRANKA, "panda_joint{}", "panda_link{}"),
    "seven axes, sia": Shape(SIA),
    "seven continuous axes, gen3": Shape(
        IIWA, continuous=True, limit='<limit effort="39" velocity="0.8"/>'
    ),
    "on a rail": Shape(ON_RAIL, external=1),
    "on a turntable": Shape(ON_TABLE, external=1),
    # frames beside the chain
    "no extra leaf": Shape(extra=""),
    "world under the base": Shape(
        extra=BASE + link("world") + fixed("world_joint", "world", "base_link")
    ),
    "flange and tool0 twins": Shape(extra=twins("flange"), tips=("tool0", "flange")),
    "flange before tool0": Shape(
        edit=(('"link_6"/><child link="tool0"', '"flange"/><child link="tool0"'),),
        extra=BASE + link("flange") + beside("fixed", "joint_6-flange", "link_6", "flange"),
    ),
    "ee_link, tool0 and a camera": Shape(extra=twins("ee_link", "camera")),
    "self-collision bodies at every link, fr3": Shape(
        extra="".join(
            link(f"link_{n}_sc") + fixed(f"link_{n}_sc_joint", f"link_{n}", f"link_{n}_sc")
            for n in range(1, 7)
        )
    ),
    "inertia of the base in its own link, ur": Shape(
        extra=BASE
        + link("base_link_inertia", mass(4))
        + fixed("b", "base_link", "base_link_inertia")
    ),
    "imu on the pedestal": Shape(
        extra=BASE + link("imu") + fixed("imu_joint", "base", "imu", NO_AXIS)
    ),
    "two arms on one torso": Shape(
        extra=link("left_1")
        + beside("revolute", "left_joint_1", "base_link", "left_1", MIMIC)
        + link("left_tool0")
        + fixed("left_tool", "left_1", "left_tool0")
    ),
    # axes and limits where nothing moves
    "zero axis on the tool's joint": Shape(tool_joint=NO_AXIS),
    "zero axis, limits and mimic on a fixed joint": Shape(
        tool_joint=NO_AXIS + LIMIT.format(effort=0) + '<mimic joint="joint_1"/>'
    ),
    "fingers behind the tool": Shape(extra=hand("link_6", mimics=False)),
    "fingers of which one mimics": Shape(extra=hand("link_6", mimics=True)),
    "piston of a weight balance mimics, abb and fanuc": Shape(
        extra=BASE
        + link("piston", mass(80))
        + beside("revolute", "piston_joint", "link_1", "piston", MIMIC)
    ),
    "a joint beside without limits": Shape(
        extra=BASE + link("valve") + beside("revolute", "valve_joint", "link_3", "valve", NO_AXIS)
    ),
    "floating and planar joints beside": Shape(
        extra=BASE
        + link("part")
        + beside("floating", "part_joint", "base_link", "part")
        + link("cart")
        + beside("planar", "cart_joint", "base_link", "cart")
    ),
    # limits
    "no effort, no velocity": Shape(limit='<limit lower="-3" upper="3"/>'),
    "effort and velocity of zero": Shape(
        limit='<limit effort="0" lower="-3" upper="3" velocity="0"/>'
    ),
    "limits of 1e16": Shape(
        limit='<limit effort="1e16" lower="-1e16" upper="1e16" velocity="1e16"/>'
    ),
    "limits inf": Shape(limit='<limit effort="inf" lower="-inf" upper="inf" velocity="inf"/>'),
    "continuous joints without limits": Shape(continuous=True, limit=""),
    "safety, calibration, dynamics": Shape(
        limit=LIMIT.replace("{effort}", "100")
        + '<safety_controller k_velocity="0" k_position="1"/><calibration rising="0"/>'
        '<dynamics damping="0.1" friction="0"/>'
    ),
    # links
    "masses": Shape(inner=mass(12.5)),
    "masses without tensor": Shape(inner=mass(12.5, "")),
    "tensors that no body has": Shape(
        inner=mass(3, '<inertia ixx="-1" ixy="5" ixz="0" iyy="1" iyz="0" izz="0"/>')
    ),
    "inertia without mass": Shape(inner='<inertial><origin xyz="0 0 1"/></inertial>'),
    "meshes of a package that is not there": Shape(
        inner=mesh("package://no_such_package/meshes/link.stl")
        + mesh("package://x/y.dae", "visual")
    ),
    "visuals without numbers": Shape(
        inner='<visual><origin xyz=""/><geometry><box size="a"/></geometry></visual>'
    ),
    "empty collisions and a capsule": Shape(
        inner="<collision/><collision><geometry/></collision>"
        '<collision><geometry><capsule radius="0.1" length="0.3"/></geometry></collision>'
    ),
    # the file
    "blank lines before the declaration": Shape(head='\n\n<?xml version="1.0"?>\n'),
    "byte order mark and a licence before the declaration": Shape(
        head='\ufeff<!-- licence: none\n  --><?xml version="1.0" encoding="UTF-8"?>'
    ),
    "western letters that nothing declares": Shape(
        head="<!-- 30° über Kopf -->", encoding="latin-1"
    ),
    "western letters, declared": Shape(
        head='<?xml version="1.0" encoding="ISO-8859-1"?><!-- ±185° -->', encoding="latin-1"
    ),
    "utf-16 of Windows, its line ends": Shape(
        head='<?xml version="1.0"?>\r\n\r\n', encoding="utf-16"
    ),
    "namespaces: drake's by default, xacro's unused": Shape(
        attributes='xmlns="http://drake.mit.edu" xmlns:xacro="http://ros.org/wiki/xacro" name="arm"'
    ),
    "transmissions, gazebo, ros2_control, materials": Shape(
        extra='<material name="m"><color rgba="1 0 0 1"/></material>'
        '<gazebo reference="link_1"><selfCollide>1</selfCollide></gazebo>'
        '<transmission name="t"><joint name="joint_1"/></transmission>'
        '<ros2_control name="c" type="system"><joint name="joint_1"/></ros2_control>' + BASE
    ),
    "long names with dots, slashes and prefixes": Shape(
        joint="cell_7/left.manipulator_with_a_very_long_prefix-joint_{}", link="cell_7/left.link {}"
    ),
}


def test_there_are_at_least_52_shapes():
    assert len(SHAPES) >= 52


@pytest.mark.parametrize("name", SHAPES)
def test_a_public_shape_is_accepted_and_its_forward_position_is_right(name, tmp_path, capfd):
    shape = SHAPES[name]
    path = tmp_path / "arm.urdf"
    path.write_bytes(shape.text().encode(shape.encoding))
    found = check(path, tcp=shape.tip)
    assert found.holds["tcp"] == shape.tip
    assert shape.tip in found.holds["tips"]
    assert found.holds["joints"] == [shape.joint.format(n + 1) for n in range(len(shape.arm.axes))]
    robot = Robot.from_file(path, shape.tip)
    assert robot.external_axes == shape.external
    for q in np.random.default_rng(0).uniform(-1.0, 1.0, (3, len(shape.arm.axes))):
        T_root_base = np.eye(4)
        np.testing.assert_allclose(robot.forward(q), T_root_base @ shape.arm.forward(q), atol=1e-12)
    assert check(path).holds["tips"] == found.holds["tips"]
    assert capfd.readouterr() == ("", "")


def test_leaves_that_nothing_moves_are_no_tips():
    shape = SHAPES["flange and tool0 twins"]
    assert list(tip_links(parse_urdf(shape.text()))) == list(shape.tips)
    assert "base" not in tip_links(parse_urdf(shape.text()))


def test_the_mass_of_a_balance_counts_where_it_stands_at_zero():
    shape = SHAPES["piston of a weight balance mimics, abb and fanuc"]
    joints = Robot.from_urdf(shape.text(), "tool0").chain.joints
    assert [joint.mass for joint in joints] == [80.0, 0.0, 0.0, 0.0, 0.0, 0.0]


def test_shapes_that_are_missing_stop_only_what_needs_them(tmp_path):
    text = SHAPES["meshes of a package that is not there"].text()
    robot = Robot.from_urdf(text, "tool0", meshes=find_meshes(text, tmp_path))
    assert robot.jacobian(np.zeros(6)).translation.shape == (3, 6)
    with pytest.raises(
        FileAccessError, match=r"link 'base_link': mesh 'package://no_such_package/"
    ):
        collision_model(robot)


def test_capsules_are_read_and_joints_without_limits_take_one_number():
    capsules = Robot.from_urdf(SHAPES["empty collisions and a capsule"].text(), "tool0")
    assert collision_model(capsules)[1].ngeoms == 7
    turning = Robot.from_urdf(SHAPES["continuous joints without limits"].text(), "tool0")
    assert collision_model(turning)[0].nq == 6


@pytest.mark.parametrize("name", ["seven axes, iiwa", "seven axes, franka", "seven axes, sia"])
def test_an_arm_of_seven_axes_follows_a_path_of_poses_without_a_jump(name):
    robot = Robot.from_urdf(SHAPES[name].text(), "tool0")
    start = np.array([0.3, 0.6, -0.2, -1.2, 0.4, 0.9, 0.1])
    T = np.repeat(robot.forward(start)[None], 20, axis=0)
    T[:, 0, 3] -= np.linspace(0.0, 0.05, 20)
    q = joints_along_path(inverse_for(robot), T, np.empty((20, 0)), start, str)
    np.testing.assert_allclose(robot.forward(q), T, atol=1e-8)
    assert np.abs(np.diff(np.vstack([start, q]), axis=0)).max() < 0.1


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        (Shape(inner=mass(-2)), r"link 'base_link': <mass value='-2'> is -2 kg"),
        (
            Shape(limit='<limit effort="0" lower="1" upper="-1" velocity="1"/>'),
            r"joint 'joint_1': <limit lower=1 upper=-1>: lower must not be above upper",
        ),
        (
            Shape(edit=(("0.0 0.0 1.0", "0 0 0"),)),
            r"joint 'joint_1': <axis xyz='0 0 0'> must not be",
        ),
        (Shape(limit=LIMIT + '<mimic joint="x"/>'), r"joint 'joint_1' mimics another one"),
        (
            Shape(extra=BASE + beside("fixed", "twice", "link_1", "base")),
            "'base' is the child of two",
        ),
        (
            Shape(
                extra=link("a")
                + link("b")
                + beside("fixed", "ab", "a", "b")
                + beside("fixed", "ba", "b", "a")
            ),
            "form a loop: a, b do not hang on 'base_link'",
        ),
        (
            Shape(attributes='name="$(arg name)"'),
            r"a xacro template.*`xacro FILE.xacro > ROBOT.urdf`",
        ),
        (Shape(extra="<xacro:arm/>"), "a xacro template"),
        (
            Shape(extra="<xacro:arm/>", attributes='xmlns:xacro="http://ros.org/wiki/xacro"'),
            "a xacro template",
        ),
        (Shape(edit=(('type="revolute"', 'type="fixed"'),)), "has no joint that moves"),
    ],
)
def test_what_is_no_arm_is_refused_with_file_and_joint(shape, message, tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(shape.text(), encoding="utf-8")
    with pytest.raises(RobotError, match=r"arm\.urdf: .*" + message):
        check(path)


def test_a_xacro_file_is_known_by_its_suffix(tmp_path):
    path = tmp_path / "arm.urdf.xacro"
    path.write_text(Shape(extra="<xacro:arm/>").text())
    with pytest.raises(RobotError, match=r"arm\.urdf\.xacro: this is a xacro template"):
        check(path)


@pytest.mark.slow
def test_three_thousand_leaves_are_checked_once(tmp_path):
    leaves = "".join(link(f"f{n}") + fixed(f"fj{n}", "link_3", f"f{n}") for n in range(3000))
    path = tmp_path / "arm.urdf"
    path.write_text(Shape(extra=leaves).text())
    assert len(check(path).holds["tips"]) == 3001


def with_branches(text, at, *branches):
    """Return a URDF with chains behind a link, each of some kinds of joints."""
    made = ""
    for number, kinds in enumerate(branches):
        parent = at
        for k, kind in enumerate(kinds):
            name, mimics = f"more_{number}_{k}", kind == "mimic"
            made += (
                f'<link name="{name}"/><joint name="{name}_joint"'
                f' type="{"prismatic" if mimics else kind}"><parent link="{parent}"/>'
                f'<child link="{name}"/><axis xyz="0 1 0"/>'
                '<limit lower="0" upper="0.04" velocity="1" effort="10"/>'
                f"{'<mimic joint=' + repr('more_0_0_joint') + '/>' if mimics else ''}</joint>"
            )
            parent = name
    return text.replace("</robot>", f"{made}</robot>")


class TestAGripper:
    shape = SHAPES["flange and tool0 twins"]

    @pytest.mark.parametrize(
        "fingers",
        [
            (["prismatic"], ["mimic"]),
            (["prismatic", "fixed"], ["prismatic", "fixed"]),
            (["revolute", "revolute", "fixed"], ["revolute", "mimic"], ["revolute", "mimic"]),
            # Bars of which one is driven: as many joints in none.
            (["revolute", "fixed", "mimic"], ["mimic"], ["mimic", "fixed", "mimic"], ["mimic"]),
            (["revolute"], ["mimic", "mimic"]),
        ],
    )
    def test_the_hand_and_not_a_finger_is_the_tip(self, fingers):
        text = with_branches(self.shape.text(), "tool0", *fingers)
        assert tip_links(parse_urdf(text)) == tip_links(parse_urdf(self.shape.text()))
        joints = [f"joint_{n + 1}" for n in range(len(self.shape.arm.axes))]
        robot = Robot.from_urdf(text, tool_link(text))
        assert len(robot.joint_names) == len(joints)
        assert robot.external_axes == self.shape.external

    @pytest.mark.parametrize("finger", ["more_0_0", "more_1_0"])
    def test_a_finger_as_tip_adds_no_axes(self, finger):
        text = with_branches(self.shape.text(), "tool0", ["prismatic"], ["mimic"])
        hand = Robot.from_urdf(text, "tool0")
        robot = Robot.from_urdf(text, finger)
        assert robot.joint_names == hand.joint_names
        assert robot.external_axes == hand.external_axes
        q = np.linspace(0.1, 0.6, len(hand.joint_names))
        np.testing.assert_allclose(
            np.linalg.inv(hand.forward(q)) @ robot.forward(q),
            np.linalg.inv(hand.forward(0 * q)) @ robot.forward(0 * q),
            atol=1e-12,
        )

    def test_the_arms_of_a_torso_are_no_fingers(self):
        arm = ["revolute"] * 5
        text = with_branches(self.shape.text(), "tool0", arm, arm)
        assert {"more_0_4", "more_1_4"} <= tip_links(parse_urdf(text)).keys()

    def test_a_single_sliding_joint_is_an_axis(self):
        text = with_branches(self.shape.text(), "tool0", ["prismatic"])
        assert "more_0_0" in tip_links(parse_urdf(text))


def test_an_srdf_is_refused_as_what_it_is(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text('<robot name="r"><group name="arm"><joint name="a"/></group></robot>')
    with pytest.raises(RobotError, match=r"^.*arm\.urdf: this is an SRDF, which groups"):
        check(path)
