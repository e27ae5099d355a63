"""Parts that do not belong to the run: left out with the reason, or doubted."""

import json
from dataclasses import replace

import numpy as np
import pytest

from elastocal.codec import read_codec, write_codec
from elastocal.elastic import ElasticModel, layout
from elastocal.errors import IdentificationError
from elastocal.identification import calibrate
from elastocal.identification.model_file import write_model
from elastocal.report.document import Options, gather
from support.cells import Cell, linear_truth, robot
from support.reported import MADE


def absent(parts):
    return {each.name: each.reason for each in parts.absent}


def test_a_model_of_other_readings_is_doubted(copied):
    folder = copied("run", "model.json")
    model = folder / "model.json"
    record = json.loads(model.read_text())
    record["calibration"]["held_out"]["mean"] *= 1.01
    model.write_text(json.dumps(record))
    parts = gather(Options(folder), MADE)
    assert not parts.again.same
    assert any("does not give the figures of the model file" in doubt for doubt in parts.doubts)


def test_a_model_of_another_robot_is_no_part_of_the_run(copied, tmp_path):

    folder = copied("run")
    readings = Cell(linear_truth(), poses=8).readings()
    found = calibrate(
        ElasticModel(robot(), layout(robot(), "bearing")), readings, np.random.default_rng(0)
    )
    write_model(folder / "model.json", found.calibrated, {})
    assert "is a model of" in absent(gather(Options(folder), MADE))["calibrated model"]
    with pytest.raises(IdentificationError, match="is a model of"):
        gather(Options(folder, model=folder / "model.json"), MADE)


def test_a_codec_of_another_robot_or_of_other_poses_is_no_part_of_the_run(copied):

    folder = copied("run", "codec")
    data = read_codec(folder / "codec")
    for changed, told in (
        (replace(data, robot="another"), "is a codec of another"),
        (replace(data, contact=data.contact + 0.5), "at other places"),
        (replace(data, pose_labels=((99,), *data.pose_labels[1:])), "has pose 99"),
    ):
        write_codec(folder / "codec", changed)
        assert told in absent(gather(Options(folder), MADE))["codec"]


def test_a_process_of_another_cell_is_no_part_of_the_run(copied):
    folder = copied("run", "process")
    path = folder / "process" / "table.json"
    path.write_text(path.read_text().replace('"cell": "afp"', '"cell": "other"'))
    assert "of cell 'other'" in absent(gather(Options(folder), MADE))["process"]


def test_a_process_with_another_model_is_doubted(copied):
    folder = copied()
    model = folder / "model.json"
    model.write_text(model.read_text() + "\n")
    assert any("another model" in doubt for doubt in gather(Options(folder), MADE).doubts)


def test_a_tool_of_another_robot_is_no_part_of_the_run(copied):
    folder = copied("run", "tool.json")
    path = folder / "tool.json"
    path.write_text(path.read_text().replace('"flange": "', '"flange": "no_'))
    assert "is no link of" in absent(gather(Options(folder), MADE))["tool file"]


def test_a_cell_file_that_was_changed_after_the_plan_is_doubted(copied):
    folder = copied("run")
    path = folder / "run" / "cell" / "cell.yaml"
    path.write_text(path.read_text().replace('disk_radius: "25 mm"', 'disk_radius: "24 mm"'))
    assert any("fingerprint" in doubt for doubt in gather(Options(folder), MADE).doubts)
