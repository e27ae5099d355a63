import dataclasses

import numpy as np
import pytest
from hypothesis import given, strategies as st

from elastocal.elastic import ElasticModel, Gear, Hinge, SpringLoad, layout
from elastocal.elastic.layouts import orthogonal_axes
from elastocal.elastic.model import FrictionElements
from elastocal.elastic.springs.hinge import axial
from elastocal.elastic.springs.kinds import check_springs
from elastocal.elastic.springs.spring import as_axis
from elastocal.errors import SpringError
from elastocal.records import from_data, to_data
from support.cells import robot

COMPONENT = st.floats(-10.0, 10.0).filter(lambda x: abs(x) > 1e-3 or x == 0.0)


@given(st.tuples(COMPONENT, COMPONENT, COMPONENT).filter(any))
def test_virtual_axes_are_orthonormal_to_the_joint_axis_and_named_in_order(axis):
    made = orthogonal_axes(axis)
    frame = np.array([as_axis(axis), *made.values()])
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-9)
    assert list(made) == sorted(made)
    # Each axis is named after the coordinate axis it is made of, and so points its way.
    assert all(made[name]["xyz".index(name)] > 0.0 for name in made)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("along", "others"), [("x", "yz"), ("y", "xz"), ("z", "xy")])
def test_a_coordinate_axis_has_the_other_two_whichever_way_it_points(along, others, sign):
    axis = sign * np.eye(3)["xyz".index(along)]
    expected = {name: tuple(np.eye(3)["xyz".index(name)]) for name in others}
    assert orthogonal_axes(axis) == expected


def test_an_oblique_axis_takes_the_two_coordinate_axes_least_aligned_with_it():
    assert set(orthogonal_axes([0.9, 0.3, -0.1])) == {"y", "z"}
    assert set(orthogonal_axes([0.1, 0.3, -0.9])) == {"x", "y"}


def test_the_least_aligned_axis_is_only_projected():
    """Gram-Schmidt starts with it, so it stays in the plane of itself and the joint axis."""
    axis = as_axis([0.9, 0.3, -0.1])
    found = orthogonal_axes(axis)["z"]
    assert np.linalg.det([axis, [0.0, 0.0, 1.0], found]) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("axis", [(0, 0, 0), (1, 0), (np.nan, 0, 1), (np.inf, 0, 0), 3.0])
def test_what_is_no_axis_is_refused(axis):
    with pytest.raises(SpringError, match=r"axis .* must be three finite numbers"):
        as_axis(axis)


def test_units_follow_the_kind():
    spring = Hinge("a", "joint_1", (0.0, 0.0, 1.0))
    assert (spring.kind, spring.parameters[0].unit.si) == ("revolute", "rad/(N*m)")
    linear = dataclasses.replace(spring, revolute=False)
    assert (linear.kind, linear.parameters[0].unit.si) == ("prismatic", "m/N")


@pytest.mark.parametrize(
    "changes",
    [
        {"revolute": False},
        {"offset": (0.0, 0.1, 0.0)},
        {"axis": (1.0, 0.0, 0.0)},
        {"axis": (0.0, 0.0, -1.0)},
    ],
)
def test_only_a_spring_along_the_joints_own_motion_is_axial(changes):
    joint = robot().chain.joints[0]
    assert axial(joint).axes[0].is_axis_of(joint)
    assert not dataclasses.replace(axial(joint), **changes).axes[0].is_axis_of(joint)


@pytest.mark.parametrize(
    ("springs", "message"),
    [
        ((), "at least one spring"),
        ((Hinge("a", "joint_1", (1.0, 0.0, 0.0)),) * 2, "'a' is listed twice"),
        ((Hinge("a", "joint1", (1.0, 0.0, 0.0)),), "did you mean 'joint_1'"),
        ((Hinge("a", "joint_1", (2.0, 0.0, 0.0)),), r"'a'.*\(2.0, 0.0, 0.0\)"),
        ((Hinge("a", "joint_1", (0.0, 0.0, 0.0)),), "'a'"),
        ((Hinge("a", "joint_1", (np.nan, 0.0, 0.0)),), "'a'"),
        (
            (Hinge("a", "joint_1", (1.0, 0.0, 0.0), offset=(0.0, np.inf, 0.0)),),
            "offset of spring 'a'",
        ),
    ],
)
def test_springs_that_do_not_fit_are_refused_by_name(springs, message):
    with pytest.raises(SpringError, match=message):
        check_springs(springs, robot().joint_names)
    with pytest.raises(SpringError, match=message):
        ElasticModel(robot(), springs)


def test_bearing_has_the_papers_eighteen_springs_in_its_order():
    names = [spring.name for spring in layout(robot(), "bearing")]
    assert names[:6] == [f"joint_{number}.axial" for number in range(1, 7)]
    assert names[6:10] == ["joint_1.x", "joint_1.y", "joint_2.x", "joint_2.z"]
    assert len(names) == 18


PLAYS = Gear(
    "a.gear", "a", (0.0, 0.0, 1.0), knees=(400.0, 1500.0), slips=(100.0, 300.0), plays=True
)


def turned(gear: Gear, torques: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Return the angles along a course of torques, the first of which finds the gear free."""
    friction = FrictionElements(np.array([0, 0]), np.array(gear.slips))
    states = friction.path(torques[:, None])
    load = SpringLoad((torques,), (), tuple(states.T))
    return c @ np.array(gear.angles(load)[0])


def test_a_gear_of_plays_grows_with_the_torque_whatever_came_before():
    rng = np.random.default_rng(0)
    for c in rng.uniform(0.0, 1e-6, (20, 5)):
        torques = np.cumsum(rng.normal(0.0, 300.0, 50))
        change, angle = np.diff(torques), np.diff(turned(PLAYS, torques, c))
        assert np.all(angle * np.sign(change) >= -1e-18)
    stops = dataclasses.replace(PLAYS, plays=False)
    assert np.any(np.diff(turned(stops, np.array([0.0, 50.0]), np.ones(5) * [0, 0, 0, 1, 1])) < 0)


def test_lost_motion_is_what_large_torques_of_both_signs_leave():
    c = np.array([1.0, 2.0, 3.0, 4.0, 5.0]) * 1e-7
    for gear in (PLAYS, dataclasses.replace(PLAYS, plays=False)):
        there, back = (turned(gear, np.array([0.0, s * 1e4, 0.0]), c)[-1] for s in (1.0, -1.0))
        (lost,) = [each for each in gear.characteristics if "lost motion" in each.name]
        assert abs(there - back) == pytest.approx(c @ np.array(lost.weights), rel=1e-12)


def test_a_gear_of_a_file_that_does_not_speak_of_plays_has_none():
    data = to_data(dataclasses.replace(PLAYS, plays=False))
    data.pop("plays", None)
    assert from_data(Gear, data, "a file") == dataclasses.replace(PLAYS, plays=False)
