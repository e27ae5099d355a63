"""``elastocal codec`` as a user meets it."""

import json
from pathlib import Path

import numpy as np
import pytest

from elastocal import dataset
from elastocal.codec import read_codec
from support.cells import Cell, linear_truth
from support.cli import elastocal


@pytest.fixture(scope="module")
def data(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("codec") / "data.nc"
    dataset.write(Cell(linear_truth(), poses=9).measure(), path)
    return path


@pytest.mark.slow
def test_arrays_and_figures_are_written_and_printed(data, tmp_path):
    out = tmp_path / "codec"
    result = elastocal(
        "codec", data, "--compare", "springs=actuated,bearing", "--out", out, "--json"
    )
    assert result.code == 0, result.err
    printed, kept = json.loads(result.out), json.loads((out / "codec.json").read_text())
    kept.pop("content_sha256")  # of the file alone
    assert set(printed["files"]) == {path.name for path in out.iterdir()}
    assert {key: printed[key] for key in kept} == kept
    assert set(kept) >= {"variants", "saturation", "paired"}
    arrays = read_codec(out)
    medians = np.median(arrays.errors("bearing"), axis=0).tolist()
    assert kept["variants"]["bearing"]["error_mean"] == medians
    assert str(data) in arrays.provenance


@pytest.mark.slow
def test_pictures_and_indices_are_written_when_asked_for(data, tmp_path):
    out = tmp_path / "c"
    result = elastocal("codec", data, "--out", out, "--indices", "--per-axis", "--splits", "4")
    assert result.code == 0, result.err
    names = {path.name for path in out.iterdir()}
    figures = {f"{name}.svg" for name in ("codec", "codec-x", "compliances", "indices")}
    assert names >= figures | {"codec.html", "indices.csv"}
    kept = json.loads((out / "codec.json").read_text())["indices"]
    assert {each["index"] for each in kept} >= {"o1", "i", "covering_radius"}
    assert {each["kind"] for each in kept} == {"growth", "size", "size_and_split"}


@pytest.mark.slow
def test_without_a_comparison_the_default_stands_alone(data, tmp_path):
    result = elastocal("codec", data, "--out", tmp_path / "c", "--splits", "3")
    assert result.code == 0, result.err
    assert result.out == ""
    for text in ("9 poses, 3 splits", "default", "Training poses", "codec.nc"):
        assert text in result.err


@pytest.mark.slow
def test_options_reach_the_codec(data, tmp_path):
    out = tmp_path / "c"
    result = elastocal(
        "codec", data, "--out", out, "--splits", "2", "--ratio", "50/50", "--seed", "4",
        "--tolerance", "20 %, 1 um", "--jobs", "1", "--compare", "solver=bounded,unbounded",
        "--compare", "load_cases=normal+north,all", "--exclude", "0:east",
    )  # fmt: skip
    assert result.code == 0, result.err
    settings = json.loads((out / "codec.json").read_text())["settings"]
    assert (settings["training"], settings["verification"], settings["splits"]) == (4, 5, 2)
    assert (settings["seed"], settings["tolerance"], settings["floor"]) == (4, 0.2, 1e-6)
    names = [each.name for each in read_codec(out).variants]
    assert names == [f"{a}, {b}" for a in ("bounded", "unbounded") for b in ("normal+north", "all")]


def test_both_files_pass_the_check(data, tmp_path):
    elastocal("codec", data, "--out", tmp_path / "c", "--splits", "2")
    for name, kind in (("codec.nc", "codec"), ("codec.json", "verdict file of a codec")):
        result = elastocal("check", tmp_path / "c" / name, "--json")
        found = json.loads(result.out)
        assert found["kind"] == kind
        assert [type(name) for name in found["variants"]] == [str]
        assert isinstance(found["variants"], list)


@pytest.mark.slow
def test_a_folder_with_files_is_kept_unless_forced(data, tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    arguments = ("codec", data, "--out", tmp_path, "--splits", "2")
    assert "holds files already (mine.txt)" in elastocal(*arguments).reason
    assert elastocal(*arguments, "--force").code == 0
    assert (tmp_path / "mine.txt").read_text() == "mine"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--compare", "search=cover,iops"), "did you mean 'ioops'"),
        (("--compare", "springs=actuated,bering"), "did you mean 'bearing'"),
        (("--compare", "load_cases=normal,nort"), "did you mean 'north'"),
        (("--compare", "solver=bounded,lsqlin"), "allowed: bounded, unbounded"),
        (("--compare", "spring=a,b"), "did you mean 'springs'"),
        (("--compare", "search=cover", "--compare", "search=ioops"), "search stands twice"),
        (("--splits", "10"), "10 splits wanted"),
        (("--ratio", "99/1"), "9 poses split"),
        (("--ratio", "a/b"), "two numbers above 0"),
        (("--ratio", "1/0"), "two numbers above 0"),
        (("--tolerance", "5 mm"), "a part and a length"),
        (("--exclude", "77"), "pose 77"),
        (("--robot", "nobody"), "nobody"),
    ],
)
def test_what_cannot_be_done_is_one_line_and_leaves_no_folder(data, tmp_path, options, words):
    out = tmp_path / "codec"
    assert words in elastocal("codec", data, "--out", out, *options).reason
    assert not out.exists()
