"""`elastocal compare` as a user meets it."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from elastocal import dataset
from elastocal.identification import CalibrateResult, write_model
from elastocal.identification.recertification import CompareSummary
from elastocal.records import read_json
from support.cells import Cell, linear_truth, unseen
from support.cli import elastocal
from support.recertified import calibrated, soft_truth
from support.summaries import made_up_summary


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("compare")
    dataset.write(Cell(linear_truth()).measure(), folder / "measured.nc")
    for name, model in {
        "old": calibrated(linear_truth(), 0),
        "new": calibrated(linear_truth(), 1),
        "soft": replace(
            calibrated(soft_truth(), 50_000),
            provenance=f"{folder / 'measured.nc'}; plan 0123456789ab",
        ),
        "six": calibrated(linear_truth(), 1, "actuated"),
    }.items():
        write_model(folder / f"{name}.json", model, made_up_summary(1e-3))
    loads = unseen(linear_truth())
    header = [f"joint_{n}[rad]" for n in range(1, 7)] + [f"force_{axis}[N]" for axis in "xyz"]
    rows = np.hstack([loads.joint_position, loads.force])
    np.savetxt(folder / "rows.csv", rows, delimiter=",", header=",".join(header), comments="")
    return folder


def run(folder: Path, *arguments: object, old: str = "old", new: str = "soft"):
    return elastocal("compare", folder / f"{old}.json", folder / f"{new}.json", *arguments)


@pytest.mark.slow
def test_a_softened_gear_is_named_to_people(folder):
    result = run(folder, "--rows", folder / "rows.csv", "--limit", "0.03 mm")
    assert result.code == 0
    assert result.out == ""
    said = " ".join(result.err.split())
    assert "beyond their intervals: joint_3.axial (+" in said
    assert "Failed: the largest change over the " in said
    assert "holds for all 13 comparisons at once" in said
    assert "sum 1: joint_4.axial + " in said
    assert "Largest change at: row " in said


@pytest.mark.slow
@pytest.mark.parametrize(
    ("limit", "verdict"), [("0.03 mm", "fail"), ("0.17 mm", "undecided"), ("1 mm", "pass")]
)
def test_every_verdict_is_a_result_and_no_error(folder, limit, verdict):
    result = run(folder, "--rows", folder / "rows.csv", "--limit", limit, "--json")
    assert (result.code, result.err) == (0, "")
    figures = json.loads(result.out)
    assert figures["schema"] == "elastocal.comparison/1"
    assert figures["verdict"] == verdict
    assert figures["moved"] == ["joint_3.axial"]


def test_without_rows_springs_are_compared_and_the_verdict_is_left_open(folder):
    result = run(folder, "--limit", "0.1 mm")
    assert result.code == 0
    said = " ".join(result.err.split())
    assert "Moved beyond their intervals: joint_3.axial" in said
    assert "Not judged: a limit is held against" in said
    assert f"--rows, e.g. {folder / 'measured.nc'}" in said
    assert json.loads(run(folder, "--limit", "0.1 mm", "--json").out)["verdict"] is None


def test_readings_of_a_dataset_serve_as_rows(folder):
    result = run(folder, "--rows", folder / "measured.nc", "--json")
    found = json.loads(result.out)
    assert found["ground"]["rows"] == 155
    # One pose of the new campaign has none of the old within 30 deg in every joint.
    assert found["deflection"]["rows"] == found["ground"]["rows_covered"] == 150


def test_file_and_figure_are_written_and_checked(folder, tmp_path):
    out, figure = tmp_path / "c.json", tmp_path / "c.svg"
    result = run(folder, "--rows", folder / "rows.csv", "--out", out, "--figure", figure)
    assert result.code == 0
    assert read_json(out, CompareSummary).moved == ("joint_3.axial",)
    assert "joint_3.axial" in figure.read_text()
    checked = json.loads(elastocal("check", out, "--json").out)
    assert checked["kind"] == "comparison of two calibrations"
    # Fewer than the 200 that were given: both campaigns have to cover a row.
    assert checked["compared"] == 13
    assert 150 < checked["rows"] < 200


def test_without_rows_the_headline_is_the_change_where_both_measured(folder):
    shown = run(folder).err
    assert "\nCalibrated readings compared: 145\n" in shown
    found = json.loads(run(folder, "--json").out)
    assert found["deflection"] is None
    assert found["calibrated"]["rows"] == 145
    at_rows = json.loads(run(folder, "--rows", folder / "measured.nc", "--json").out)
    assert at_rows["calibrated"] is None
    # The readings of this dataset are those poses and forces, but for some micrometres of sag.
    for name in ("mean", "largest"):
        here, there = found["calibrated"][name], at_rows["deflection"][name]
        assert here["value"] == pytest.approx(there["value"], rel=0.05)


def test_the_table_has_80_columns_and_tells_rigid_springs_apart(folder, tmp_path):
    made = {name: read_json(folder / f"{name}.json", CalibrateResult) for name in ("old", "soft")}
    for name, each in made.items():
        model = each.calibrated
        stiff = [model.model.parameter_names.index(spring) for spring in ("joint_1.x", "joint_1.y")]
        compliance, draws = model.compliance.copy(), model.draws.copy()
        compliance[stiff], draws[:, stiff] = 0.0, 0.0
        rigid = replace(model, compliance=compliance, draws=draws)
        write_model(tmp_path / f"{name}.json", rigid, made_up_summary(1e-3))
    shown = run(tmp_path).err
    assert "Rigid in both: joint_1.x, joint_1.y.\n" in shown
    table = shown.split("Compliance")[1].split("Rigid in both")[0]
    assert "…" not in table.replace(" … ", "")
    assert not any(line.startswith(("joint_1.x", "joint_1.y")) for line in table.splitlines())
    assert max(map(len, table.split("   sum 1:")[0].splitlines())) <= 80


def test_models_with_other_springs_are_compared_with_a_word_of_warning(folder):
    said = " ".join(run(folder, new="six").err.split())
    assert "Only in the old model: joint_1.x" in said
    assert "depends on which others are in the model" in said
    assert "Not determined by both: joint_4.axial, joint_5.axial, joint_6.axial" in said


def test_an_unchanged_cell_has_not_moved(folder):
    assert "Of 13 compared springs and sums of springs, not one moved" in " ".join(
        run(folder, new="new").err.split()
    )


@pytest.mark.parametrize("limit", ["0.1", "-0.1 mm", "0 mm", "5 N", "nan mm", ""])
def test_a_limit_without_unit_or_not_above_zero_is_refused(folder, limit):
    assert "--limit" in run(folder, "--limit", limit).reason


def test_one_file_twice_is_refused(folder):
    assert "one and the same file: nothing to compare" in run(folder, new="old").reason


def test_rows_that_cannot_be_used_are_refused(folder, tmp_path):
    text = (folder / "rows.csv").read_text()
    for name, content, said in (
        ("other.csv", text.replace("joint_3", "elbow"), "column 'joint_3[deg]' is missing"),
        ("empty.csv", text.splitlines()[0], "no row"),
        ("bare.csv", text.replace("[N]", ""), "has no unit"),
        ("rows.txt", text, "suffix '.txt' is not one of .csv, .nc"),
    ):
        (tmp_path / name).write_text(content)
        reason = run(folder, "--rows", tmp_path / name).reason
        assert name in reason
        assert said in reason
    assert "cannot read" in run(folder, "--rows", tmp_path / "nothing.csv").reason


def test_a_dataset_of_another_robot_is_refused(folder, tmp_path):
    data = dataset.read(folder / "measured.nc").to_xarray().copy()
    data.attrs["robot_urdf"] = data.attrs["robot_urdf"].replace("1.15", "1.25")
    dataset.write(dataset.Dataset.from_xarray(data), tmp_path / "other.nc")
    assert "are of different robots" in run(folder, "--rows", tmp_path / "other.nc").reason


def test_a_damaged_model_is_named(folder, tmp_path):
    broken = tmp_path / "broken.json"
    broken.write_text((folder / "new.json").read_text()[:4000])
    assert (
        "broken.json is not valid JSON" in elastocal("compare", folder / "old.json", broken).reason
    )


@pytest.mark.parametrize("option", ["--out", "--figure"])
def test_an_input_is_not_overwritten(folder, option):
    before = (folder / "old.json").read_bytes()
    assert "is an input of this command" in run(folder, option, folder / "old.json").reason
    assert (folder / "old.json").read_bytes() == before


def test_a_figure_of_another_kind_is_refused_and_nothing_is_written(folder, tmp_path):
    result = run(folder, "--out", tmp_path / "c.json", "--figure", tmp_path / "c.bmp")
    assert "suffix '.bmp' is not one of .pdf, .png, .svg" in result.reason
    assert list(tmp_path.iterdir()) == []
