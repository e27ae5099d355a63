"""`elastocal stiffness` as a user meets it."""

import json
from pathlib import Path

import numpy as np
import pytest

from elastocal.errors import RobotError
from elastocal.identification import write_model
from elastocal.robot import Robot
from elastocal.workflows._inputs import require_same_robot
from support.cells import robot
from support.cli import elastocal
from support.geared import SLIPS, geared
from support.paths import (
    calibrated,
    dome_course,
    euler_columns,
    made_up,
    read_csv,
    start_text,
    write_csv,
)
from support.simulated import example_cell, places
from support.urdfs import KR_LIKE, opw_arm_urdf

FILES = {"postures.csv", "choice.csv", "stiffness.svg", "stiffness.json"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("stiffness")
    write_model(folder / "model.json", calibrated())
    write_csv(folder / "path.csv", euler_columns(dome_course(9)))
    return folder


def run(folder: Path, out: str, *arguments: object):
    return elastocal(
        "stiffness", folder / "model.json", folder / "path.csv", "--out", folder / out, "--spins",
        6, "--start", start_text(), *arguments,
    )  # fmt: skip


def test_it_writes_maps_tables_and_key_figures(folder):
    result = run(folder, "all", "--json")
    assert result.code == 0, result.err
    figures = json.loads(result.out)
    assert {path.name for path in (folder / "all").iterdir()} == FILES == set(figures["files"])
    names = [choice["name"] for choice in figures["choices"]]
    assert names == ["as programmed", "one posture for the path", "stiffest at each station"]
    programmed, one, each = (choice["softest"] for choice in figures["choices"])
    assert programmed <= one * (1 + 1e-12)
    assert one <= each * (1 + 1e-12)
    assert figures["postures"]["tried"] == 9 * 6 * 8
    assert json.loads((folder / "all/stiffness.json").read_text())["stations"] == 9


def test_the_tables_hold_what_the_figures_say(folder):
    figures = json.loads(run(folder, "tables", "--json").out)
    rows = (folder / "tables/choice.csv").read_text().splitlines()
    assert len(rows) == 1 + 3 * 9
    k = read_csv_text(folder / "tables/choice.csv", "stiffness[N/m]")
    softest = [choice["softest"] for choice in figures["choices"]]
    np.testing.assert_allclose(k.reshape(3, 9).min(axis=1), softest, rtol=1e-8)
    surveyed = read_csv(folder / "tables/postures.csv", "line", "spin[deg]", "stiffness[N/m]")
    assert len(surveyed) == 9 * 6
    np.testing.assert_allclose(surveyed[:, 2].reshape(9, 6).max(axis=1), k[18:], rtol=1e-8)


def read_csv_text(path: Path, name: str) -> np.ndarray:
    header, *rows = (line.split(",") for line in path.read_text().splitlines())
    return np.array([float(row[header.index(name)]) for row in rows])


def test_the_same_question_gives_the_same_picture(folder):
    for name in ("a", "b"):
        assert run(folder, name, "--direction", "1,0,0").code == 0
    one, other = (folder / name / "stiffness.svg" for name in ("a", "b"))
    assert one.read_bytes() == other.read_bytes()
    assert "stiffness along (1,0,0) in base" in (folder / "a/stiffness.svg").read_text()


def test_people_are_told_the_choice(folder):
    words = " ".join(run(folder, "told", "--stations", "1").err.split())
    for text in ("48 of 48 postures are allowed", "one posture for the path", "in N/µm", "deg"):
        assert text in words


def test_a_survey_in_which_nothing_is_allowed_is_told_and_drawn(folder):
    beams = [
        {
            "name": f"beam {number}",
            "box": {"size": ["0.3 m", "9 m", "0.3 m"]},
            "pose": {"xyz": ["0.9 m", "0 m", f"{height} m"]},
        }
        for number, height in enumerate((1.4, 1.7, 2.0))
    ]
    cell = example_cell("afp", fixtures=beams)
    write_model(folder / "tight.json", made_up(cell.robot))
    q = np.array([place.q for place in places("afp", 2)])
    pose = euler_columns(cell.robot.forward(q))
    write_csv(folder / "tight.csv", pose | {f"{cell.robot.joint_names[0]}[m]": q[:, 0]})
    result = elastocal(
        "stiffness", folder / "tight.json", folder / "tight.csv", "--out", folder / "tight",
        "--spins", 2, "--cell", cell.path,
    )  # fmt: skip
    assert result.code == 0, result.err
    words = " ".join(result.err.split())
    assert "0 of 416 postures are allowed; refused:" in words
    assert "none" in words
    assert "no single posture is allowed at every station" in words


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (("--direction", "up"), "direction 'up' must be 'normal' or three numbers"),
        (("--direction", "0,0,0"), "must be 'normal' or three numbers"),
        (("--start", "0 deg"), "has 1 values"),
    ],
)
def test_what_cannot_be_done_is_one_line(folder, arguments, why):
    assert why in run(folder, "bad", *arguments).reason
    assert not (folder / "bad").exists()


def test_a_cell_brings_its_rail_its_margins_and_its_tooling(folder):
    cell = example_cell("afp")
    write_model(folder / "afp.json", made_up(cell.robot))
    q = np.array([place.q for place in places("afp", 2)])
    rail = {f"{cell.robot.joint_names[0]}[m]": q[:, 0]}
    write_csv(folder / "afp.csv", euler_columns(cell.robot.forward(q)) | rail)
    result = elastocal(
        "stiffness", folder / "afp.json", folder / "afp.csv", "--out", folder / "afp", "--spins",
        3, "--cell", cell.path, "--json",
    )  # fmt: skip
    assert result.code == 0, result.err
    figures = json.loads(result.out)
    assert set(figures["postures"]["refused"]) == {
        "reach and joint limits", "joint margin", "singularity", "collision",
    }  # fmt: skip
    assert figures["postures"]["tried"] == 2 * 3 * len(cell.external_positions) * 8
    assert "Rail in m" in (folder / "afp/stiffness.svg").read_text()
    refused = elastocal(
        "stiffness", folder / "model.json", folder / "path.csv", "--out", folder / "no", "--cell",
        cell.path,
    )  # fmt: skip
    assert "they must be the same" in refused.reason


def test_a_cell_of_another_robot_is_refused():
    cell, names = example_cell("afp"), ("model.json", "afp")
    require_same_robot(cell.robot, cell.robot, names)
    with pytest.raises(RobotError, match="they must be the same"):
        require_same_robot(robot(), cell.robot, names)
    other = Robot.from_urdf(opw_arm_urdf(**KR_LIKE), "tcp")
    with pytest.raises(RobotError, match="mm apart"):
        require_same_robot(robot(), other, names)


def test_a_model_with_friction_says_at_which_loads_the_stiffness_holds(folder):
    write_model(folder / "geared.json", geared())
    asked = (folder / "path.csv", "--start", start_text(), "--spins", 4, "--stations", 3)
    found = elastocal("stiffness", folder / "geared.json", *asked, "--out", folder / "geared")
    assert found.code == 0, found.err
    words = " ".join(found.err.split())
    assert f"well over {max(SLIPS):.0f} N·m in a joint" in words
    assert "friction" not in run(folder, "plain").err
