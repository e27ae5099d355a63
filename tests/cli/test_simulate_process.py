"""`elastocal simulate-process` as a user meets it."""

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest

import elastocal as ec
from elastocal.compensation import process
from elastocal.compensation.process import read_process
from elastocal.files import sha256
from elastocal.identification import write_model
from elastocal.planning import cell_surface
from support.cli import elastocal
from support.compiled import CompiledCorrector
from support.exported import needs_gcc
from support.live_loop import LiveCorrector
from support.paths import made_up
from support.simulated import example_cell

FILES = {"table.json", "table.csv", "deviations.csv", "path.csv"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("process")
    write_model(folder / "model.json", made_up(example_cell("afp").robot))
    write_model(folder / "other.json", made_up(example_cell("machining").robot))
    return folder


def run(folder: Path, out: str, *arguments: object, model: str = "model.json"):
    return elastocal(
        "simulate-process", example_cell("afp").path, "--process", "afp", "--model",
        folder / model, "--out", folder / out, "--courses", 1, *arguments,
    )  # fmt: skip


@pytest.mark.slow
def test_it_writes_the_table_and_every_point_of_it(folder):
    result = run(folder, "all", "--seed", 2, "--json")
    assert result.code == 0, result.err
    figures = json.loads(result.out)
    assert {path.name for path in (folder / "all").iterdir()} == FILES
    (line,) = figures["lines"]
    assert line["name"] == "seed 2"
    with (folder / "all/deviations.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == line["points"]
    before = np.abs([float(row["before[mm]"]) for row in rows])
    after = np.abs([float(row["after[mm]"]) for row in rows])
    assert before.mean() == pytest.approx(1e3 * line["before"]["mean"], abs=1e-6)
    assert after.max() == pytest.approx(1e3 * line["after"]["max"], abs=1e-6)
    assert line["reduction"]["mean"] == pytest.approx(1.0 - after.mean() / before.mean(), abs=1e-4)
    (source,) = figures["runs"]
    model = (folder / "model.json").read_text(encoding="utf-8")
    assert source["model_sha256"] == sha256(model)
    assert figures["settings"]["cycle"] == 0.004
    assert not figures["budget"]


def test_in_python_a_model_needs_no_file(folder, tmp_path):
    model = made_up(example_cell("afp").robot)
    result = ec.simulate_process(
        example_cell("afp").path, models=[model], kind="afp", courses=1, out=tmp_path / "all"
    )
    (source,) = result.runs
    written = (folder / "model.json").read_text(encoding="utf-8")
    assert (source.model, source.model_sha256) == ("the model", sha256(written))


def test_the_offset_of_a_course_is_read_and_its_time_said(folder):
    given = "--seed", 2, "--json"
    bare, read = (
        json.loads(run(folder, out, *given, *option).out)
        for out, option in (("bare", ()), ("offset", ("--course-offset",)))
    )
    # 1100 N and a swing, up and down at 400 N/s, then dwell and average of the cell's procedure.
    assert read["landing_seconds"] == pytest.approx(2 * 1100 / 400 + 1.5, abs=0.5)
    assert bare["landing_seconds"] is None
    assert any("reading in light contact" in note for note in read["notes"])
    # The uncorrected path begins at once, as before; another reading of noise in the sensor's.
    assert read["lines"][0]["before"] == pytest.approx(bare["lines"][0]["before"])
    # A model that is made up is wrong by more than the cell: its offset is worth much.
    assert read["spatial"][0]["after"]["mean"] < bare["spatial"][0]["after"]["mean"]


@pytest.mark.slow
@needs_gcc
def test_the_c_of_the_target_gives_the_same_figures(folder, tmp_path, monkeypatch):
    given = "--seed", 2, "--course-offset", "--json"
    by_python = json.loads(run(folder, "python", *given).out)
    made = []

    def compiled(compensator):
        made.append(CompiledCorrector(compensator, tmp_path / f"c{len(made)}"))
        return made[-1]

    monkeypatch.setattr(process, "ModelCorrector", compiled)
    by_c = json.loads(run(folder, "c", *given).out)
    assert made
    for key in ("lines", "spatial"):
        for one, other in zip(by_python[key], by_c[key], strict=True):
            for when in ("before", "after"):
                assert other[when] == pytest.approx(one[when], rel=0, abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("option", "within"),
    # The offset of a course enters one cycle later, with the next reading of the sensor.
    [((), 1e-12), (("--course-offset",), 2e-7)],
)
def test_the_loop_of_live_gives_the_same_figures(folder, monkeypatch, option, within):
    given = "--seed", 2, *option, "--json"
    word = "offset" if option else "bare"
    by_python = json.loads(run(folder, f"python {word}", *given).out)
    made = []

    def looped(compensator):
        made.append(LiveCorrector(compensator))
        return made[-1]

    monkeypatch.setattr(process, "ModelCorrector", looped)
    by_live = json.loads(run(folder, f"live {word}", *given).out)
    assert made
    for key in ("lines", "spatial"):
        for one, other in zip(by_python[key], by_live[key], strict=True):
            for when in ("before", "after"):
                assert other[when] == pytest.approx(one[when], rel=0, abs=within)


@pytest.mark.slow
def test_check_knows_the_table_and_the_folder(folder):
    result = run(folder, "checked", "--seed", 4)
    assert result.code == 0, result.err
    for path in (folder / "checked/table.json", folder / "checked"):
        told = json.loads(elastocal("check", path, "--json").out)
        assert told["kind"] == "simulated process"
        assert told["seeds"] == [4]
    assert told["courses"] == 1


@pytest.mark.slow
def test_the_place_of_every_deviation_lies_on_the_course(folder):
    result = run(folder, "placed", "--seed", 4)
    assert result.code == 0, result.err
    (trace,) = read_process(folder / "placed").courses
    surface = cell_surface(example_cell("afp"))
    some = trace.position[::50]
    down = np.repeat(-surface.T_base_surface[None, :3, 2], len(some), axis=0)
    hits, index, _ = surface.rays.ray.intersects_location(
        some - 0.1 * down, down, multiple_hits=False
    )
    np.testing.assert_allclose(hits[np.argsort(index)], some, atol=1e-3)
    steps = np.linalg.norm(np.diff(trace.position, axis=0), axis=1)
    np.testing.assert_allclose(steps, 0.1 * 0.004, rtol=0.02)


@pytest.mark.slow
def test_its_programmed_path_is_one_that_compensate_takes(folder):
    result = run(folder, "programme", "--seed", 2)
    assert result.code == 0, result.err
    path, corrected = folder / "programme/path.csv", folder / "corrected.csv"
    result = elastocal("compensate", folder / "model.json", path, "--out", corrected, "--json")
    assert result.code == 0, result.err
    tables = []
    for name in (path, corrected):
        with name.open() as file:
            tables.append(list(csv.DictReader(file)))
    programmed, left = tables
    assert json.loads(result.out)["rows"] == len(programmed)
    assert [row["time[s]"] for row in programmed] == [row["time[s]"] for row in left]
    pressed = [np.hypot(*(float(row[f"force_{a}[N]"]) for a in "xy")) for row in programmed]
    assert max(pressed) > 100.0


@pytest.mark.parametrize(
    ("arguments", "model", "reason"),
    [
        (("--seed", 1, "--seed", 1), "model.json", "each seed counts once"),
        ((), "other.json", "the model's robot has the joints"),
    ],
)
def test_what_does_not_fit_is_refused_in_one_line(folder, arguments, model, reason):
    result = run(folder, "refused", *arguments, model=model)
    assert reason in result.reason
    assert not (folder / "refused").exists()


def own(folder: Path, out: str, *arguments: object):
    """Run the path of one's own that an earlier test's process has written."""
    path = folder / "built_in/path.csv"
    if not path.exists():
        result = run(folder, "built_in", "--seed", 2)
        assert result.code == 0, result.err
    return elastocal(
        "simulate-process", example_cell("afp").path, "--path", path, "--model",
        folder / "model.json", "--out", folder / out, "--seed", 2, "--json", *arguments,
    )  # fmt: skip


@pytest.mark.slow
def test_a_path_of_ones_own_deviates_as_the_built_in_process_that_it_repeats(folder):
    result = own(folder, "own", "--load", "0.5,-1")
    assert result.code == 0, result.err
    table = json.loads(result.out)
    built_in = json.loads((folder / "built_in/table.json").read_text())
    for key in ("lines", "spatial"):
        (found,), (wanted,) = table[key], built_in[key]
        # A path says no time: its rows are passed at one speed, so filters lag otherwise.
        for side, allowed in (("before", 0.02), ("after", 0.05)):
            assert found[side]["mean"] == pytest.approx(wanted[side]["mean"], rel=allowed)
    assert table["process"] == "path.csv"
    assert table["direction"] == built_in["direction"] == "lateral"
    half, turned = table["loads"]
    assert (half["load"], turned["load"]) == (0.5, -1.0)
    assert 0.35 < half["spatial"][0]["before"]["mean"] / table["spatial"][0]["before"]["mean"] < 0.7
    assert [(each["name"], each["load"]) for each in table["means"]] == [
        ("lateral", 1.0), ("3-D", 1.0), ("lateral", 0.5), ("3-D", 0.5), ("lateral", -1.0),
        ("3-D", -1.0),
    ]  # fmt: skip
    assert table["means"][0]["mean_reduction"]["low"] is None
    assert "one simulated run" in table["notes"][0]


def test_the_3d_deviation_is_never_below_its_component(folder):
    result = own(folder, "spatial")
    assert result.code == 0, result.err
    (trace,) = read_process(folder / "spatial").courses
    for k, component in enumerate((trace.before, trace.after)):
        assert np.all(trace.spatial[:, k] >= np.abs(component) - 1e-8)
    table = json.loads(result.out)
    assert table["spatial"][0]["before"]["mean"] == pytest.approx(
        trace.spatial[:, 0].mean(), abs=1e-9
    )


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (("--process", "afp"), "give either --process afp or machining, or --path"),
        (("--courses", 2), "--courses goes with --process only"),
        (("--load", "0"), "--load 0: a share of the force is not 0"),
        (("--load", "0.5,0.5"), "--load 0.5 is run once"),
        (("--load", "half"), "--load 'half' must be numbers"),
        (("--direction", "up"), "direction 'up' must be 'lateral', 'normal' or three numbers"),
        (("--speed", "5"), "5"),
    ],
)
def test_what_does_not_go_with_a_path_is_refused(folder, arguments, reason):
    result = own(folder, "refused", *arguments)
    assert result.code != 0
    assert reason in result.err
    assert not (folder / "refused").exists()


@pytest.mark.slow
def test_the_stiffest_posture_is_stiffer_than_the_programmed_one_and_is_compared_with_it(folder):
    result = elastocal(
        "simulate-process", example_cell("machining").path, "--process", "machining",
        "--courses", 1, "--model", folder / "other.json", "--out", folder / "stiff",
        "--posture", "stiffest", "--json",
    )  # fmt: skip
    assert result.code == 0, result.err
    table = json.loads(result.out)
    gain = table["posture"]
    assert gain["softest"] > gain["softest_programmed"] > 0.0
    assert gain["lines"][0]["points"] == table["lines"][0]["points"]
    assert gain["lines"][0]["before"] != table["lines"][0]["before"]
    (course,) = read_process(folder / "stiff").courses
    assert len(course.time) == table["lines"][0]["points"]


def test_an_unknown_posture_is_refused(folder):
    result = run(folder, "lazy", "--posture", "laziest")
    assert "--posture 'laziest' is not one of programmed, stiffest" in result.reason


@pytest.mark.slow
def test_over_several_seeds_means_have_an_interval(folder):
    result = run(folder, "seeds", "--seed", 2, "--seed", 3, "--json")
    assert result.code == 0, result.err
    table = json.loads(result.out)
    lateral = table["means"][0]
    each = [line["reduction"]["mean"] for line in table["lines"][:2]]
    assert lateral["mean_reduction"]["mean"] == pytest.approx(np.mean(each))
    # Student's t of two seeds: 12.706 standard errors.
    half = 12.706 * abs(each[1] - each[0]) / 2.0
    assert lateral["mean_reduction"]["high"] == pytest.approx(np.mean(each) + half, rel=1e-3)
    assert table["notes"] == []


def test_an_unknown_process_is_refused(folder):
    result = elastocal(
        "simulate-process", example_cell("afp").path, "--process", "milling", "--model",
        folder / "model.json", "--out", folder / "no",
    )  # fmt: skip
    assert "'milling' is not one of afp, machining" in result.reason


def test_settings_in_another_frame_are_refused_by_file(folder):
    (folder / "tcp.yaml").write_text("schema: elastocal.compensator/1\nframe: tcp\n")
    result = run(folder, "framed", "--settings", folder / "tcp.yaml")
    assert "tcp.yaml: frame is 'tcp'" in result.reason


@pytest.mark.slow
def test_people_see_before_after_and_reduction_within_80_columns(folder):
    result = run(folder, "told", "--seed", 2)
    lines = result.err.splitlines()
    words = " ".join(result.err.split())
    assert "seed 2" in words
    for what in ("Without correction", "With correction in mm", "Reduction", "Paper, reduction"):
        assert re.search(rf"{what.lower()}.*?(-?[\d.]+%? ){{3}}", words.lower()), what
    table = [line for line in lines if re.search(r"  -?[\d.]+%?$", line)]
    assert len(table) > 6
    assert max(map(len, table)) <= 80


def test_files_for_some_seeds_only_are_refused(folder):
    result = run(folder, "some", "--seed", 1, "--seed", 2, "--seed", 3, "--model", folder / "x")
    assert "--model is given 2 times for 3 seeds" in result.reason


@pytest.mark.slow
def test_the_figures_do_not_depend_on_the_number_of_processes(folder):
    two = ("--courses", 2, "--seed", 2)
    for jobs in (1, 2):
        result = elastocal(
            "simulate-process", example_cell("afp").path, "--process", "afp", "--model",
            folder / "model.json", "--out", folder / f"jobs{jobs}", "--jobs", jobs, *two,
        )  # fmt: skip
        assert result.code == 0, result.err
    one, other = ((folder / f"jobs{n}/deviations.csv").read_bytes() for n in (1, 2))
    assert one == other
