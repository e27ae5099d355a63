"""From files to parts: what is missing, damaged or foreign, and how that is told."""

import json
import shutil

import pytest

from elastocal.errors import FileAccessError, IdentificationError, SchemaError
from elastocal.report.document import Options, gather
from support.reported import MADE, POSES


def absent(parts):
    return {each.name: each.reason for each in parts.absent}


def damage(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def test_everything_is_found_under_its_default_name(parts, finished):
    assert set(absent(parts)) == {"earlier calibration"}
    assert parts.name == "afp"
    assert parts.robot == "KR 120 R2700 extra HA"
    assert parts.simulated
    assert len(parts.plan.poses) == len(parts.dataset.poses) == POSES
    assert parts.limits.tolerance == pytest.approx(0.3e-3)
    assert parts.limits.drift == pytest.approx(0.1e-3)
    assert parts.doubts == ()
    assert {each.name for each in parts.files} >= {
        *("run/journal.jsonl", "run/dataset.nc", "run/cell/cell.yaml", "run/cell/dome.stl"),
        *("run/plan/plan.json", "run/plan/pool.nc", "model.json", "tool.json"),
        *("codec/codec.nc", "codec/codec.json", "process/table.json", "process/deviations.csv"),
    }


def test_the_run_itself_may_be_named_in_place_of_the_folder_around_it(parts, finished):
    inner = gather(Options(finished / "run"), MADE)
    assert [(each.name, each.sha256) for each in inner.files] == [
        (each.name, each.sha256) for each in parts.files
    ]
    assert inner.absent == parts.absent


def test_the_calibration_made_again_is_that_of_the_model_file(parts):
    assert parts.again.same
    held_out = parts.calibrated.figures["held_out"]
    unseen = parts.again.unseen
    assert unseen.mean.value == pytest.approx(held_out["mean"], rel=1e-9)
    assert unseen.max == pytest.approx(held_out["max"], rel=1e-9)
    assert unseen.mean.low < unseen.mean.value < unseen.mean.high
    assert unseen.p95.low <= unseen.p95.value <= unseen.p95.high <= unseen.max
    assert unseen.poses == unseen.folds == POSES


def test_settings_in_the_model_file_are_followed(copied):
    from support.cli import elastocal

    folder = copied("run")
    made = elastocal(
        *("calibrate", folder / "run" / "dataset.nc", "--out", folder / "model.json"),
        *("--exclude", "2:north", "--loss", "huber", "--draws", 40),
    )
    assert made.code == 0, made.err
    parts = gather(Options(folder), MADE)
    assert parts.again.same
    assert (2, "north") not in zip(
        parts.again.unseen.pose.tolist(), parts.again.unseen.load_case, strict=True
    )


def test_a_model_of_other_readings_is_doubted(copied):
    folder = copied("run", "model.json")
    model = folder / "model.json"
    record = json.loads(model.read_text())
    record["calibration"]["held_out"]["mean"] *= 1.01
    model.write_text(json.dumps(record))
    parts = gather(Options(folder), MADE)
    assert not parts.again.same
    assert any("does not give the figures of the model file" in doubt for doubt in parts.doubts)


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("model.json", "calibrated model"),
        ("tool.json", "tool file"),
        ("codec", "codec"),
        ("process", "process"),
    ],
)
def test_what_is_not_there_is_missing_with_the_command_that_makes_it(copied, name, told):
    folder = copied()
    (shutil.rmtree if (folder / name).is_dir() else (folder / name).unlink)(
        *([folder / name] if (folder / name).is_dir() else [])
    )
    reason = absent(gather(Options(folder), MADE))[told]
    assert f"there is no {name}; `elastocal " in reason


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("run/journal.jsonl", "journal"),
        ("run/cell/cell.yaml", "cell"),
        ("run/cell/dome.stl", "surface"),
        ("run/plan/plan.json", "plan"),
        ("run/plan/pool.nc", "pool"),
        ("run/dataset.nc", "dataset"),
        ("run/summary.json", "summary of the run"),
        ("model.json", "calibrated model"),
        ("tool.json", "tool file"),
        ("codec/codec.nc", "codec"),
        ("process/table.json", "process"),
        ("process/deviations.csv", "process"),
    ],
)
def test_what_is_damaged_is_told_without_the_folder_that_it_lies_in(copied, name, told):
    folder = copied()
    path = folder / name
    if name.endswith("journal.jsonl"):
        path.write_text("nonsense\n" + path.read_text())
    else:
        damage(path)
    parts = gather(Options(folder), MADE)
    found = {each.name: each for each in parts.absent if each.damaged}
    assert set(found) == {told}
    assert str(folder) not in found[told].reason
    assert len(found[told].reason.splitlines()) == 1


@pytest.mark.parametrize("key", ["model", "tool", "codec", "process"])
def test_what_is_named_and_damaged_is_refused(copied, key):
    folder = copied()
    names = {"model": "model.json", "tool": "tool.json", "codec": "codec", "process": "process"}
    named = folder / names[key]
    inner = {"codec": named / "codec.nc", "process": named / "table.json"}.get(key, named)
    damage(inner)
    with pytest.raises(SchemaError, match=inner.name):
        gather(Options(folder, **{key: named}), MADE)


@pytest.mark.parametrize("key", ["model", "tool", "codec", "process"])
def test_what_is_named_and_not_there_is_refused(finished, tmp_path, key):
    with pytest.raises(FileAccessError, match="nowhere"):
        gather(Options(finished, **{key: tmp_path / "nowhere"}), MADE)


@pytest.mark.parametrize(
    ("change", "path"),
    [
        (lambda figures: figures.update(suspicious=[{"pose": "three"}]), "suspicious.0"),
        (lambda figures: figures.update(warnings=7), "warnings"),
        (lambda figures: figures["held_out"].pop("mean"), "held_out.mean"),
        (lambda figures: figures["settings"].update(bounds="low"), "bounds"),
    ],
)
def test_figures_of_another_kind_make_a_model_unusable(copied, change, path):
    folder = copied("run", "model.json")
    record = json.loads((folder / "model.json").read_text())
    change(record["calibration"])
    (folder / "model.json").write_text(json.dumps(record))
    assert path in absent(gather(Options(folder), MADE))["calibrated model"]


def test_a_summary_of_another_kind_is_unusable(copied):
    folder = copied("run")
    path = folder / "run" / "summary.json"
    summary = json.loads(path.read_text())
    del summary["noise"]
    path.write_text(json.dumps(summary))
    assert "noise" in absent(gather(Options(folder), MADE))["summary of the run"]


def test_a_model_alone_is_enough(finished, tmp_path):
    shutil.copy(finished / "model.json", tmp_path / "mine.json")
    parts = gather(Options(tmp_path / "mine.json"), MADE)
    assert parts.calibrated is not None
    assert parts.name == parts.robot == "KR 120 R2700 extra HA"
    assert {"run", "codec", "tool file", "process"} <= set(absent(parts))


def test_a_model_of_another_robot_is_no_part_of_the_run(copied, tmp_path):
    import numpy as np

    from elastocal.elastic import ElasticModel, layout
    from elastocal.identification import calibrate
    from elastocal.identification.model_file import write_model
    from support.cells import Cell, linear_truth, robot

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
    from dataclasses import replace

    from elastocal.codec import read_codec, write_codec

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


@pytest.mark.parametrize("names", [(), ("notes.txt",), ("run",)])
def test_a_folder_without_any_part_is_refused(tmp_path, names):
    for name in names:
        (tmp_path / name).write_text("x")
    with pytest.raises(FileAccessError, match=r"neither journal\.jsonl"):
        gather(Options(tmp_path), MADE)


def test_a_path_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(FileAccessError, match="there is no such file or folder"):
        gather(Options(tmp_path / "nowhere"), MADE)


def test_a_tolerance_on_the_command_line_goes_before_that_of_the_cell(finished):
    parts = gather(Options(finished, tolerance=1e-3, drift=2e-3), MADE)
    assert (parts.limits.tolerance, parts.limits.drift) == (1e-3, 2e-3)
    assert "--tolerance" in parts.limits.source


def test_an_earlier_model_is_compared_over_the_readings_of_the_run(finished, tmp_path):
    from support.cli import elastocal

    old = tmp_path / "old.json"
    made = elastocal(
        *("calibrate", finished / "run" / "dataset.nc", "--out", old),
        *("--exclude", "0", "--draws", 40),
    )
    assert made.code == 0, made.err
    parts = gather(Options(finished, old=old), MADE)
    found = parts.recertification
    assert len(found.deflection.q) == len(parts.again.unseen.error)
    assert found.limit == pytest.approx(0.1e-3)
