import pytest

from elastocal.dataset._layout import VARIABLES, joint_name_problem


@pytest.mark.parametrize("name", ["joint_1", "a1", "E1", "joint a é", "rail", "axis_x"])
def test_ordinary_joint_names_are_accepted(name):
    assert joint_name_problem(name) is None


@pytest.mark.parametrize("name", ["pose", "status", "force_x", "tcp_position_z", "marker_sigma"])
def test_a_joint_cannot_take_the_name_of_something_else(name):
    assert joint_name_problem(name) == "the name stands for something else in a dataset"


@pytest.mark.parametrize("name", ["", " a", "a ", "a[b", "a]", "a,b", "a;b", 'a"b', "#a", "a\nb"])
def test_a_joint_name_must_survive_a_csv_header(name):
    assert "brackets, delimiters, quotes or line breaks" in str(joint_name_problem(name))


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("marker_displacment_x", "marker_displacement_x"),
        ("tcp_positon_x", "tcp_position_x"),
        ("forse_x", "force_x"),
    ],
)
def test_a_misspelt_column_is_not_taken_for_a_joint(name, meant):
    assert joint_name_problem(name) == f"it is not a joint; did you mean {meant!r}?"


def test_every_variable_says_what_it_means():
    assert all(variable.meaning and variable.unit for variable in VARIABLES)
