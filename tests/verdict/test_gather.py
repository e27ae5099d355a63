"""From files to parts: what is missing, damaged or foreign, and how that is told."""

import json
import shutil

import pytest

from elastocal.errors import FileAccessError, SchemaError
from elastocal.files import read_text
from elastocal.verdict import (
    EvidenceOptions,
    gather_evidence,
)
from elastocal.verdict._files import EvidenceFolders, PartReader, find_folders
from support.cli import elastocal
from support.reported import MADE, POSES


def test_a_single_run_of_another_name_is_found_and_of_several_none_is_guessed(tmp_path):
    (tmp_path / "model.json").write_text("{}")
    for name, found in (("lauf", "lauf"), ("second", None), ("run", "run")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "journal.jsonl").write_text("")
        run = find_folders(tmp_path).run
        assert (None if run is None else run.path.name) == found


def absent(parts):
    return {each.name: each.reason for each in parts.missing}


def damage(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


@pytest.mark.slow
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


@pytest.mark.slow
def test_the_run_itself_may_be_named_in_place_of_the_folder_around_it(parts, finished):
    inner = gather_evidence(EvidenceOptions(finished / "run"), MADE)
    assert [(each.name, each.sha256) for each in inner.files] == [
        (each.name, each.sha256) for each in parts.files
    ]
    assert inner.missing == parts.missing


def test_the_calibration_made_again_is_that_of_the_model_file(parts):
    assert parts.reproduction.same
    held_out = parts.calibrated.figures.held_out
    unseen = parts.reproduction.unseen
    assert unseen.mean.value == pytest.approx(held_out.mean, rel=1e-9)
    assert unseen.max == pytest.approx(held_out.max, rel=1e-9)
    assert unseen.mean.low < unseen.mean.value < unseen.mean.high
    assert unseen.p95.low <= unseen.p95.value <= unseen.p95.high <= unseen.max
    assert unseen.poses == unseen.folds == POSES


@pytest.mark.slow
def test_settings_in_the_model_file_are_followed(copied):
    folder = copied("run")
    made = elastocal(
        *("calibrate", folder / "run" / "dataset.nc", "--out", folder / "model.json"),
        *("--exclude", "2:north", "--loss", "huber", "--draws", 40),
    )
    assert made.code == 0, made.err
    parts = gather_evidence(EvidenceOptions(folder), MADE)
    assert parts.reproduction.same
    assert (2, "north") not in zip(
        parts.reproduction.unseen.pose.tolist(), parts.reproduction.unseen.load_case, strict=True
    )


MADE_BY = {
    "calibrated model": ("model.json", "calibrate"),
    "tool file": ("tool.json", "tool"),
    "codec": ("codec", "codec"),
    "simulated process": ("process", "simulate-process"),
}


def test_what_is_not_there_is_missing_with_the_command_that_makes_it(copied):
    reasons = absent(gather_evidence(EvidenceOptions(copied("run")), MADE))
    for told, (name, command) in MADE_BY.items():
        assert f"there is no {name}; `elastocal {command}`" in reasons[told]


@pytest.mark.parametrize(
    "damaged",
    [
        {
            "run/cell/dome.stl": "surface",
            "run/plan/pool.nc": "pool",
            "run/summary.json": "summary of the run",
            "model.json": "calibrated model",
            "tool.json": "tool file",
            "codec/codec.nc": "codec",
            "process/table.json": "simulated process",
        },
        {"run/journal.jsonl": "journal", "process/deviations.csv": "simulated process"},
        {"run/cell/cell.yaml": "cell", "run/plan/plan.json": "plan", "run/dataset.nc": "dataset"},
    ],
)
def test_what_is_damaged_is_told_without_the_folder_that_it_lies_in(copied, damaged):
    folder = copied()
    for name in damaged:
        path = folder / name
        if name.endswith("journal.jsonl"):
            path.write_text("nonsense\n" + path.read_text())
        else:
            damage(path)
    found = {
        each.name: each
        for each in gather_evidence(EvidenceOptions(folder), MADE).missing
        if each.damaged
    }
    assert set(found) == set(damaged.values())
    for each in found.values():
        assert str(folder) not in each.reason
        assert len(each.reason.splitlines()) == 1


@pytest.mark.parametrize("key", ["model", "tool", "codec", "process"])
def test_what_is_named_and_damaged_is_refused(copied, key):
    folder = copied()
    names = {"model": "model.json", "tool": "tool.json", "codec": "codec", "process": "process"}
    named = folder / names[key]
    inner = {"codec": named / "codec.nc", "process": named / "table.json"}.get(key, named)
    damage(inner)
    with pytest.raises(SchemaError, match=inner.name):
        gather_evidence(EvidenceOptions(folder, **{key: named}), MADE)


@pytest.mark.slow
@pytest.mark.parametrize("key", ["model", "tool", "codec", "process"])
def test_what_is_named_and_not_there_is_refused(finished, tmp_path, key):
    with pytest.raises(FileAccessError, match="nowhere"):
        gather_evidence(EvidenceOptions(finished, **{key: tmp_path / "nowhere"}), MADE)


@pytest.mark.slow
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
    assert path in absent(gather_evidence(EvidenceOptions(folder), MADE))["calibrated model"]


def test_a_summary_of_another_kind_is_unusable(copied):
    folder = copied("run")
    path = folder / "run" / "summary.json"
    summary = json.loads(path.read_text())
    del summary["noise"]
    path.write_text(json.dumps(summary))
    assert "noise" in absent(gather_evidence(EvidenceOptions(folder), MADE))["summary of the run"]


def test_a_model_alone_is_enough(finished, tmp_path):
    shutil.copy(finished / "model.json", tmp_path / "mine.json")
    parts = gather_evidence(EvidenceOptions(tmp_path / "mine.json"), MADE)
    assert parts.calibrated is not None
    assert parts.name == parts.robot == "KR 120 R2700 extra HA"
    assert {"run", "codec", "tool file", "simulated process"} <= set(absent(parts))


@pytest.mark.slow
def test_every_codec_of_a_folder_of_codecs_is_read(copied):
    folder = copied("run", "codec")
    (folder / "codec").rename(folder / "inner")
    for name in ("springs", "search"):
        shutil.copytree(folder / "inner", folder / "codec" / name)
    parts = gather_evidence(EvidenceOptions(folder), MADE)
    assert len(parts.codecs) == 2
    assert {"codec/search/codec.nc", "codec/springs/codec.nc"} <= {e.name for e in parts.files}
    damage(folder / "codec" / "search" / "codec.nc")
    parts = gather_evidence(EvidenceOptions(folder), MADE)
    assert len(parts.codecs) == 1
    assert "codec/search/codec.nc" in absent(parts)["codec"]
    with pytest.raises(SchemaError, match=r"search/codec\.nc"):
        gather_evidence(EvidenceOptions(folder, codec=folder / "codec"), MADE)


@pytest.mark.parametrize("names", [(), ("notes.txt",), ("run",)])
def test_a_folder_without_any_part_is_refused(tmp_path, names):
    for name in names:
        (tmp_path / name).write_text("x")
    with pytest.raises(FileAccessError, match=r"neither journal\.jsonl"):
        gather_evidence(EvidenceOptions(tmp_path), MADE)


def test_a_path_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(FileAccessError, match="there is no such file or folder"):
        gather_evidence(EvidenceOptions(tmp_path / "nowhere"), MADE)


@pytest.mark.slow
def test_a_tolerance_on_the_command_line_goes_before_that_of_the_cell(finished):
    parts = gather_evidence(EvidenceOptions(finished, tolerance=1e-3, drift=2e-3), MADE)
    assert (parts.limits.tolerance, parts.limits.drift) == (1e-3, 2e-3)
    assert "--tolerance" in parts.limits.source


@pytest.mark.slow
def test_an_earlier_model_is_compared_over_the_readings_of_the_run(finished, tmp_path):
    old = tmp_path / "old.json"
    made = elastocal(
        *("calibrate", finished / "run" / "dataset.nc", "--out", old),
        *("--exclude", "0", "--draws", 40),
    )
    assert made.code == 0, made.err
    parts = gather_evidence(EvidenceOptions(finished, old=old), MADE)
    found = parts.recertification
    assert found.ground.rows == len(parts.reproduction.unseen.error)
    # The pose that the old calibration did without has no other within 30 deg.
    assert found.deflection.rows == found.ground.rows_covered == found.ground.rows - 2
    assert found.limit == pytest.approx(0.1e-3)


@pytest.mark.parametrize("optional", [False, True])
def test_an_optional_file_is_not_missed(tmp_path, optional):
    reader = PartReader(EvidenceFolders(None, (tmp_path,)))
    found = reader.find("log", None, "log.json", read_text, "nobody makes one", optional=optional)
    assert found is None
    assert [part.name for part in reader.missing] == ([] if optional else ["log"])
