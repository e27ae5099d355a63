from dataclasses import replace

import numpy as np
import pytest

from elastocal.elastic import ElasticModel, Gear, Hinge, layout
from elastocal.elastic.layouts import bearing_joint
from elastocal.elastic.springs.tensor import Tensor
from elastocal.errors import FileAccessError, SchemaError, SpringError
from elastocal.robot import Rail, Robot, on_rail
from support.cells import robot
from support.urdfs import sliding_arm_urdf

HEAD = "schema: elastocal.springs/1\n"


@pytest.fixture
def read(tmp_path):
    path = tmp_path / "springs.yaml"

    def springs(text, head=HEAD):
        path.write_text(head + text)
        return layout(robot(), str(path))

    return springs


def test_the_example_of_the_documentation_is_read(read):
    springs = read(
        "include: actuated\n"
        "springs:\n"
        "  - {joint: joint_2, axis: x}\n"
        "  - {joint: joint_3, axis: [0, 1, 1], frame: distal}\n"
        '  - {joint: joint_6, axis: z, kind: prismatic, offset: ["0 mm", "0 mm", "150 mm"]}\n'
    )
    assert springs[:6] == layout(robot(), "actuated")
    tilt, oblique, axial = springs[6:]
    assert (tilt.name, tilt.axis, tilt.revolute, tilt.distal) == (
        "joint_2.x",
        (1.0, 0.0, 0.0),
        True,
        False,
    )
    assert oblique.distal
    assert oblique.axis == pytest.approx((0.0, np.sqrt(0.5), np.sqrt(0.5)))
    assert (axial.revolute, axial.offset) == (False, pytest.approx((0.0, 0.0, 0.15)))
    ElasticModel(robot(), springs)


def test_a_spring_has_the_name_it_is_given(read):
    (spring,) = read("springs: [{joint: joint_6, axis: x, name: spindle}]")
    assert spring.name == "spindle"


@pytest.mark.parametrize(
    ("entry", "name"),
    [
        ("axis: axial", "joint_6.axial"),
        ("axis: x, kind: revolute", "joint_6.x"),
        ("axis: x, kind: prismatic", "joint_6.linear-x"),
        ("axis: axial, kind: prismatic, frame: distal", "joint_6.linear-distal-axial"),
        ("axis: [1, 1, 0], frame: distal", "joint_6.distal-(0.707 0.707 0)"),
        ("kind: gear", "joint_6.gear-axial"),
        ("axis: y, kind: gear, frame: distal", "joint_6.gear-distal-y"),
        ("kind: tensor", "joint_6.tensor-axial"),
    ],
)
def test_a_name_tells_what_distinguishes_a_spring(read, entry, name):
    """Model files and tables name springs so; another name would orphan them."""
    (spring,) = read(f"springs: [{{joint: joint_6, {entry}}}]")
    assert spring.name == name


def test_a_torsion_of_a_joint_that_slides_says_so(tmp_path):
    path = tmp_path / "springs.yml"
    path.write_text(HEAD + "springs: [{joint: slide, kind: revolute}, {joint: slide, axis: x}]")
    sliding = Robot.from_urdf(sliding_arm_urdf(), "tcp")
    found = layout(sliding, str(path))
    assert [spring.name for spring in found] == ["slide.torsion-axial", "slide.x"]
    assert all(spring.revolute for spring in found)


def test_a_tensor_sits_at_the_offset_that_a_file_gives(read):
    (spring,) = read('springs: [{joint: joint_6, kind: tensor, offset: ["1 mm", "0 mm", "2 mm"]}]')
    assert spring == Tensor("joint_6.tensor-axial", "joint_6", (0.001, 0.0, 0.002))


def test_joints_that_slide_have_a_linear_spring_and_no_tensor():
    sliding = Robot.from_urdf(sliding_arm_urdf(), "tcp")
    springs = layout(sliding, "tensor")
    turning = [joint.name for joint in sliding.chain.joints if joint.revolute]
    assert [spring.name for spring in springs] == ["slide.axial", *(f"{j}.tensor" for j in turning)]


def test_tensors_say_the_same_of_an_arm_wherever_its_rail_stands():
    """One at the rail's own origin learnt a lever that changed with the rail."""
    urdf = on_rail(robot().urdf, Rail("rail", (0.0, 1.0, 0.0), -1.5, 1.5))
    rail = Robot.from_urdf(urdf, "tcp")
    model = ElasticModel(rail, layout(rail, "tensor"))
    q = np.array([[0.0, 0.3, -1.0, 1.2, 0.4, 0.9, -0.2], [1.4, 0.3, -1.0, 1.2, 0.4, 0.9, -0.2]])
    here, there = model.observation_blocks(q, np.tile([150.0, -80.0, 900.0], (2, 1)))
    np.testing.assert_allclose(there, here, atol=1e-12 * np.abs(here).max())


def test_virtual_springs_may_sit_behind_the_motion():
    springs = bearing_joint(robot(), distal=True)
    assert [spring.distal for spring in springs] == [False] * 6 + [True] * 12
    assert not any(spring.distal for spring in bearing_joint(robot()))


@pytest.mark.parametrize(("word", "kind"), [("gear", Gear), ("tensor", Tensor), (None, Hinge)])
def test_a_spring_is_of_the_kind_that_a_file_asks_for(read, word, kind):
    (spring,) = read(f"springs: [{{joint: joint_6{f', kind: {word}' if word else ''}}}]")
    assert type(spring) is kind


def test_an_axial_spring_takes_the_kind_of_its_joint(tmp_path):
    path = tmp_path / "springs.yml"
    path.write_text(HEAD + "springs: [{joint: slide}, {joint: roll}]")
    sliding = Robot.from_urdf(sliding_arm_urdf(), "tcp")
    assert [spring.revolute for spring in layout(sliding, str(path))] == [False, True]


def test_a_joint_that_slides_has_no_gear(tmp_path):
    path = tmp_path / "springs.yaml"
    path.write_text(HEAD + "springs: [{joint: slide, kind: gear}]")
    with pytest.raises(SpringError, match="'slide': a gear turns, and this joint slides"):
        layout(Robot.from_urdf(sliding_arm_urdf(), "tcp"), str(path))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("sprigs: []", "'sprigs'; did you mean 'springs'"),
        ("springs: [{joint: joint_6, axs: x}]", r"'springs\.0\.axs'; did you mean 'axis'"),
        ("springs: [{axis: x}]", r"'springs\.0\.joint' is missing"),
        ("springs: [{joint: joint_6, axis: w}]", r"springs\.0\.axis.*got 'w'"),
        (
            "springs: [{joint: joint_6, kind: linear}]",
            "be 'revolute', 'prismatic', 'gear' or 'tensor'.*'linear'",
        ),
        ("springs: [{joint: joint_6, frame: middle}]", r"springs\.0\.frame.*'proximal'"),
        ("springs: [{joint: joint_6, offset: [1, 2, 3]}]", "1 is not a length with its unit"),
        ("springs: [{joint: joint_6, offset: [1 mm, 2 N, 3 mm]}]", "'N' is not a length"),
        ("springs: [{joint: joint_6, axis: [.nan, 0, 1]}]", "axis"),
        ("include: bearings", "'bearing', .*got 'bearings'"),
        ("springs: 3", "springs"),
        ("1: 2", "1"),
    ],
)
def test_a_file_that_does_not_fit_is_refused_by_its_place(read, text, message):
    with pytest.raises((SchemaError, SpringError), match=message) as refusal:
        read(text)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("text", "error", "message"),
    [
        ("springs: [{joint: joint_9}]", SpringError, "'joint_9'.*joint_1, joint_2"),
        ("springs: [{joint: joint_6, axis: [0, 0, 0]}]", SpringError, "not all zero"),
        (
            "springs: [{joint: joint_6, axis: x}, {joint: joint_6, axis: x}]",
            SpringError,
            "'joint_6.x' is listed twice",
        ),
    ],
)
def test_springs_that_do_not_fit_the_robot_are_refused(read, text, error, message):
    with pytest.raises(error, match=message):
        read(text)


def test_another_schema_is_refused_by_name(read):
    with pytest.raises(SchemaError, match=r"'elastocal\.springs/2'.*'elastocal\.springs/1'"):
        read("", head="schema: elastocal.springs/2\n")


def test_a_name_that_is_no_layout_is_refused_with_the_nearest():
    with pytest.raises(SpringError, match=r"'bering'; did you mean 'bearing'.*actuated, bearing"):
        layout(robot(), "bering")


def test_a_missing_file_is_refused_by_its_path(tmp_path):
    with pytest.raises(FileAccessError, match=r"cannot read .*none\.yaml"):
        layout(robot(), str(tmp_path / "none.yaml"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1e-3 N*m/rad", "is 1000 rad/.N.m.: the largest rotational compliance is 1 rad"),
        ("1e13 N*m/rad", "'1e13 N.m/rad' is too large: the largest rotational stiffness"),
        ("2 km", "is not a stiffness or compliance with its unit"),
    ],
)
def test_a_stiffness_that_no_arm_has_is_refused(read, text, message):
    with pytest.raises(SchemaError, match=message):
        read(f'springs: [{{joint: joint_6, axis: x, stiffness: "{text}", uncertainty: "20 %"}}]')


class TestSettingsOfAKind:
    def test_they_are_fields_of_the_kind(self, read):
        (gear,) = read("springs: [{joint: joint_2, kind: gear, settings: {knees: [100, 300]}}]")
        assert gear == replace(Gear.at(gear.axes[0]), knees=(100.0, 300.0))

    @pytest.mark.parametrize(
        ("entry", "error", "reason"),
        [
            ("kind: gear, settings: {knee: [100]}", SchemaError, "joint_2.gear-axial.*knee"),
            ("kind: gear, settings: {knees: soft}", SchemaError, "knees"),
            ("kind: gear, settings: {axis: [0, 0, 1]}", SpringError, "axis is no setting of the"),
            ("kind: gear, settings: {kind: tensor}", SpringError, "kind is no setting of the kind"),
            ("settings: {knees: [100]}", SchemaError, "settings are for a kind of spring that has"),
        ],
    )
    def test_others_are_refused(self, read, entry, error, reason):
        with pytest.raises(error, match=reason):
            read(f"springs: [{{joint: joint_2, {entry}}}]")
