import dataclasses

import numpy as np
import pytest
from hypothesis import given, strategies as st

from elastocal.elastic import (
    ElasticModel,
    Hinge,
    as_axis,
    axial,
    check_springs,
    layout,
    orthogonal_axes,
)
from elastocal.errors import SpringError
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
