"""Joints by any names: those of the arm's URDF, and those of a JointState."""

import numpy as np
import pytest

from elastocal.logs.guess import guess_log
from elastocal.logs.table import LogTable

UR = ("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint",
      "wrist_3_joint")  # fmt: skip
ARM = dict.fromkeys(UR, True)


def table(*columns: str) -> LogTable:
    rng = np.random.default_rng(0)
    cells = [list(np.arange(20.0))] + [list(rng.uniform(-1.0, 1.0, 20)) for _ in columns]
    return LogTable("log", ("time", *columns), tuple(cells))


def joints_of(found) -> list[tuple[tuple[str, ...], str | None]]:
    return [(each.columns, each.unit) for each in found.columns if each.key == "joints"]


def state(names, *fields: str) -> LogTable:
    """Return the columns of a /joint_states topic, which ROS sorts by name."""
    return table(*(f"{field}.{name}" for field in fields for name in sorted(names)))


def test_joint_states_come_in_the_order_of_the_arm_where_that_is_known():
    found = guess_log("bag", "/joint_states", state(UR, "position", "velocity", "effort"), ARM)
    assert joints_of(found) == [(tuple(f"position.{name}" for name in UR), "rad")]
    assert {each.key for each in found.columns} == {"time", "joints"}


def test_joint_states_of_an_unknown_arm_ask_for_their_order():
    found = guess_log("bag", "/joint_states", state(UR, "position", "velocity"))
    ((columns, unit),) = joints_of(found)
    assert (columns, unit) == (tuple(f"position.{name}" for name in sorted(UR)), "rad")
    assert "is it that of the arm's joints?" in "\n".join(found.lines())


def test_columns_named_as_the_joints_are_joints_whatever_they_are_called():
    names = ("base", "Knick", "bras", "poignet", "wrist.b", "tool_turn")
    columns = [f"actual.{name} [deg]" for name in reversed(names)]
    found = guess_log(
        "log.csv", None, table(*columns, "Fx", "Fy", "Fz"), dict.fromkeys(names, True)
    )
    assert joints_of(found) == [(tuple(f"actual.{name} [deg]" for name in names), "deg")]
    assert any(each.key == "force" for each in found.columns)


def test_a_rail_among_the_joints_is_a_group_of_its_own_unit():
    found = guess_log("bag", "/joint_states", state(("gantry", *UR), "position"),
                      {"gantry": False} | ARM)  # fmt: skip
    assert joints_of(found) == [
        (("position.gantry",), "m"),
        (tuple(f"position.{name}" for name in UR), "rad"),
    ]


@pytest.mark.parametrize("missing", UR)
def test_of_an_arm_of_which_a_joint_is_not_logged_nothing_is_taken_by_name(missing):
    left = [name for name in UR if name != missing]
    found = guess_log("log.csv", None, table(*left), ARM)
    assert joints_of(found) == []
