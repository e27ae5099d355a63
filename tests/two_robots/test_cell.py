"""The cell file of two robots: what it refuses, by name."""

from pathlib import Path

import numpy as np
import pytest

from elastocal.cell import load_cell
from elastocal.errors import SchemaError
from elastocal.two_robots import load_pair_cell, write_pair_example
from support import two_arms
from support.two_arms import CELL


def test_a_cell_of_two_robots_has_both_up_to_their_tips(tmp_path):
    made = two_arms.cell(tmp_path)
    assert made.arms == ("left", "right")
    assert [robot.tip for robot in made.robots] == ["tcp", "tcp"]
    assert made.T_first_second[:3, 3] == pytest.approx([3.6, 0.0, 0.0])


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("base_transform:", "base_transfrom:", "base_trans"),
        ('base_transform: {xyz: ["3600 mm", "0 mm", "0 mm"], abc: ["180 deg", "0 deg", "0 deg"]}\n',
         "", "base_transform"),
        ('"3600 mm"', "3600", "unit"),
        ('["3600 mm", "0 mm", "0 mm"]', '["100 mm", "0 mm", "0 mm"]', "100 mm apart"),
        ("name: right", "name: left", "both robots are named 'left'"),
        ("name: right", "name: Left", "both robots are named 'left'"),
        ("name: left", "name: Pair", "name 'Pair': .* beside them is pair.json"),
        ("name: left", "name: ../left", "name '../left': .* are not allowed"),
        ("presses:", "clamp: true\npresses:", "clamp"),
        ('force: "1 kN"', 'force: "-1 kN"', "presses.force"),
        ("search:", "share: {weights: [0, 0]}\nsearch:", "one of the two weights"),
        ("tool_mass", "model: none.json\n    tool_mass", "there is no model 'none.json'"),
        ("KR 210 R2700-2", "KR 9", "KR 9"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused_by_its_name(tmp_path, old, new, reason):
    assert old in CELL
    with pytest.raises(SchemaError, match=reason):
        two_arms.cell(tmp_path, CELL.replace(old, new, 1))


def test_one_robot_or_three_are_refused(tmp_path):
    first, second = CELL.index("  - name: left"), CELL.index("  - name: right")
    end = CELL.index("base_transform")
    arm = CELL[first:second]
    with pytest.raises(SchemaError, match="1 robots: two are needed"):
        two_arms.cell(tmp_path, CELL[:second] + CELL[end:])
    third = arm.replace("left", "middle")
    with pytest.raises(SchemaError, match="3 robots: two are needed"):
        two_arms.cell(tmp_path, CELL[:end] + third + CELL[end:])


def test_a_cell_of_one_robot_is_none_of_two(tmp_path):
    with pytest.raises(SchemaError, match="no key 'robots'"):
        two_arms.cell(tmp_path, CELL.replace("robots:", "robot:", 1))


def test_the_commands_for_one_robot_say_that_there_are_two(tmp_path):
    made = two_arms.cell(tmp_path)
    with pytest.raises(SchemaError, match="plan-pair"):
        load_cell(made.path)


def test_clamped_tools_pull_as_well(tmp_path):
    made = two_arms.cell(tmp_path, CELL.replace('light: "50 N"', 'light: "50 N", clamped: true'))
    cases = made.file.presses.cases
    assert np.array_equal(cases["pull"], -cases["normal"])
    assert "pull" not in two_arms.cell(tmp_path).file.presses.cases


def test_the_guide_shows_the_example_that_is_written(tmp_path):
    path = write_pair_example(tmp_path / "cell.yaml")
    guide = Path(__file__).parents[2] / "docs/how-to/calibrate-two-robots.md"
    assert path.read_text(encoding="utf-8") in guide.read_text(encoding="utf-8")
    assert load_pair_cell(path).arms == ("left", "right")
