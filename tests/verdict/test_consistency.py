"""Parts that do not belong to the run: left out with the reason, or doubted."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal import dataset
from elastocal.codec import read_codec, write_codec
from elastocal.elastic import ElasticModel, layout
from elastocal.errors import IdentificationError
from elastocal.identification import calibrate, write_model
from elastocal.verdict import (
    EvidenceOptions,
    gather_evidence,
)
from support import sealed
from support.cells import Cell, linear_truth, robot
from support.reported import MADE


def absent(parts):
    return {each.name: each.reason for each in parts.missing}


def err_more(record):
    record["calibration"]["held_out"]["mean"] *= 1.01


@pytest.mark.slow
def test_a_model_of_other_readings_is_doubted(copied):
    folder = copied("run", "model.json")
    model = folder / "model.json"
    sealed.edit(model, err_more)
    parts = gather_evidence(EvidenceOptions(folder), MADE)
    assert not parts.reproduction.same
    (doubt,) = (d for d in parts.doubts if "does not give the figures of the model file" in d)
    assert "of other data or other settings, or was made by an earlier version" in doubt


def test_a_model_of_an_earlier_version_is_named_as_the_reason(copied):
    folder = copied("run", "model.json")
    model = folder / "model.json"
    sealed.edit(model, err_more)
    # What calibrations of before did not say.
    for name in ("spring_count", "coverage"):
        sealed.edit(model, lambda record, name=name: record["calibration"].pop(name))
    parts = gather_evidence(EvidenceOptions(folder), MADE)
    (doubt,) = (d for d in parts.doubts if "does not give the figures of the model file" in d)
    assert "the model was made by an earlier version of elastocal; calibrate again" in doubt
    assert "other data" not in doubt


def test_a_model_of_another_robot_is_no_part_of_the_run(copied, tmp_path):

    folder = copied("run")
    readings = Cell(linear_truth(), poses=8).readings()
    found = calibrate(
        ElasticModel(robot(), layout(robot(), "bearing")), readings, np.random.default_rng(0)
    )
    write_model(folder / "model.json", found.calibrated)
    assert (
        "is a model of"
        in absent(gather_evidence(EvidenceOptions(folder), MADE))["calibrated model"]
    )
    with pytest.raises(IdentificationError, match="is a model of"):
        gather_evidence(EvidenceOptions(folder, model=folder / "model.json"), MADE)


def test_a_codec_of_another_robot_or_of_other_poses_is_no_part_of_the_run(copied):

    folder = copied("run", "codec")
    data = read_codec(folder / "codec")
    for changed, told in (
        (replace(data, robot="another"), "is a codec of another"),
        (replace(data, contact=data.contact + 0.5), "at other places"),
        (replace(data, pose_labels=((99,), *data.pose_labels[1:])), "has pose 99"),
    ):
        write_codec(folder / "codec", changed)
        assert told in absent(gather_evidence(EvidenceOptions(folder), MADE))["codec"]


def test_a_process_of_another_cell_is_no_part_of_the_run(copied):
    folder = copied("run", "process")
    path = folder / "process" / "table.json"
    sealed.edit_text(path, '"cell": "afp"', '"cell": "other"')
    assert (
        "of cell 'other'"
        in absent(gather_evidence(EvidenceOptions(folder), MADE))["simulated process"]
    )


def test_a_process_with_another_model_is_doubted(copied):
    folder = copied()
    model = folder / "model.json"
    model.write_text(model.read_text() + "\n")
    assert any(
        "another model" in doubt for doubt in gather_evidence(EvidenceOptions(folder), MADE).doubts
    )


def test_a_tool_of_another_robot_is_no_part_of_the_run(copied):
    folder = copied("run", "tool.json")
    path = folder / "tool.json"
    sealed.edit_text(path, '"flange": "', '"flange": "no_')
    assert "is no link of" in absent(gather_evidence(EvidenceOptions(folder), MADE))["tool file"]


@pytest.mark.slow
def test_a_cell_file_that_was_changed_after_the_plan_is_doubted(copied):
    folder = copied("run")
    path = folder / "run" / "cell" / "cell.yaml"
    path.write_text(path.read_text().replace('disk_radius: "25 mm"', 'disk_radius: "24 mm"'))
    assert any(
        "fingerprint" in doubt for doubt in gather_evidence(EvidenceOptions(folder), MADE).doubts
    )


def doubts(folder):
    return " | ".join(gather_evidence(EvidenceOptions(folder), MADE).doubts)


@pytest.mark.slow
def test_parts_of_one_run_raise_no_doubt(finished):
    assert gather_evidence(EvidenceOptions(finished), MADE).doubts == ()


@pytest.mark.slow
def test_a_dataset_of_another_run_is_doubted(copied):
    folder = copied("run")
    path = folder / "run" / "dataset.nc"
    data = dataset.read(path).to_xarray().copy()
    data.attrs["provenance"] = data.attrs["provenance"].replace("seed 0", "seed 2")
    dataset.write(dataset.Dataset.from_xarray(data), path)
    assert "the dataset does not say that it is of the run" in doubts(folder)


def test_readings_that_were_struck_out_after_the_run_are_doubted(copied):
    folder = copied("run")
    path = folder / "run" / "dataset.nc"
    data = dataset.read(path).to_xarray().copy(deep=True)
    data["status"].values[0] = 1
    usable = int((data["status"].values == 0).sum())
    dataset.write(dataset.Dataset.from_xarray(data), path)
    assert f"the dataset has {usable} usable readings, the summary" in doubts(folder)


def test_a_journal_that_was_cut_is_doubted(copied):
    folder = copied("run")
    path = folder / "run" / "journal.jsonl"
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[: len(lines) // 2]))
    assert "of which the journal tells no measurement" in doubts(folder)


def test_a_summary_of_another_run_is_doubted(copied):
    folder = copied("run")
    sealed.edit(
        folder / "run" / "summary.json",
        lambda record: record["times"].update(started="2020-01-01T00:00:00+00:00"),
    )
    assert "the summary is of a run that began at another time" in doubts(folder)


@pytest.mark.slow
def test_a_codec_of_another_run_is_doubted(copied):
    folder = copied("run", "codec")
    data = read_codec(folder / "codec")
    write_codec(folder / "codec", replace(data, provenance=data.provenance + "0"))
    assert "a codec does not say" not in doubts(folder)
    write_codec(folder / "codec", replace(data, provenance="another/dataset.nc"))
    assert "a codec does not say" in doubts(folder)


@pytest.mark.parametrize(
    ("change", "told"),
    [({"tool_sha256": "0" * 64}, "another tool file"), ({"seed": 7}, "seed 7")],
)
def test_a_process_with_another_tool_or_on_another_cell_is_doubted(copied, change, told):
    folder = copied()
    sealed.edit(
        folder / "process" / "table.json", lambda record: record["runs"][0].update(**change)
    )
    if "seed" in change:
        path = folder / "process" / "deviations.csv"
        head, *rows = path.read_text().splitlines()
        path.write_text("\n".join([head, *("7" + row[1:] for row in rows)]) + "\n")
    assert told in doubts(folder)


def test_a_plan_that_was_changed_since_the_run_began_is_no_part_of_it(copied):
    folder = copied("run")
    path = folder / "run" / "plan" / "plan.json"
    path.write_text(path.read_text() + "\n")
    assert "plan.json" in absent(gather_evidence(EvidenceOptions(folder), MADE))["plan"]
