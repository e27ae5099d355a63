"""The commands as a user meets them: output, exit codes, one-line refusals."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
import typer

from elastocal import dataset
from elastocal.cli import main
from elastocal.cli.commands import COMMANDS
from elastocal.identification import write_model
from elastocal.procedure import RunFolder
from support import reported
from support.cells import Cell, linear_truth, robot, unseen, urdf
from support.cli import elastocal
from support.geared import geared

KEYS = {
    "schema", "robot", "springs", "rank", "springs_total", "condition", "unobservable", "residual",
    "deflection", "readings", "poses", "suspicious", "held_out",
}  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A folder with a dataset, the model calibrated from it, and rows to predict."""
    folder = tmp_path_factory.mktemp("calibrated")
    dataset.write(Cell(linear_truth(), poses=12).measure(), folder / "data.nc")
    result = elastocal("calibrate", folder / "data.nc", "--out", folder / "model.json")
    assert result.code == 0, result.err
    assert result.out == ""
    write_rows(folder / "rows.csv")
    (folder / "arm.urdf").write_text(urdf())
    (folder / "springs.yaml").write_text(
        "schema: elastocal.springs/1\ninclude: actuated\nsprings:\n  - {joint: joint_2, axis: x}\n"
    )
    return folder


def write_rows(path: Path, angle: str = "rad", force: str = "N", scale: float = 1.0) -> None:
    rows = unseen(linear_truth())
    names = [f"{name}[{angle}]" for name in robot().joint_names]
    header = ["note", *names, *(f"force_{axis}[{force}]" for axis in "xyz")]
    q = np.degrees(rows.joint_position) if angle == "deg" else rows.joint_position
    lines = [",".join(header)]
    for number, values in enumerate(np.hstack([q, rows.force * scale])):
        lines.append(",".join([f"row {number}", *(repr(float(value)) for value in values)]))
    path.write_text("\n".join(lines) + "\n")


def columns(path: Path, *names: str) -> np.ndarray:
    header, *rows = (line.split(",") for line in path.read_text().splitlines())
    return np.array([[float(row[header.index(name)]) for name in names] for row in rows])


@pytest.mark.slow
def test_calibrate_prints_a_table_that_answers_the_first_questions(folder):
    shown = elastocal("calibrate", folder / "data.nc", "--out", folder / "again.json").err
    for text in (
        "left-out poses",
        "Above the best allowed",
        "interval",
        "not by itself",
        "group 1",
    ):
        assert text in shown


@pytest.mark.slow
def test_calibrate_json_has_the_ladder_and_the_measured_coverage_of_its_intervals(folder):
    """Spec section 8: ``ladder: [{springs, held_out, chosen}]``, ``coverage``."""
    result = elastocal("calibrate", folder / "data.nc", "--out", folder / "again.json", "--json")
    figures = json.loads(result.out)
    ladder = figures["ladder"]
    assert [rung["springs"] for rung in ladder] == [
        "actuated", "bearing", "bearing-ends", "links", "tensor", "gears",
    ]  # fmt: skip
    assert [rung["chosen"] for rung in ladder].count(True) == 1
    assert all(0.0 < rung["held_out"] < 1e-3 for rung in ladder)
    taken = next(rung for rung in ladder if rung["chosen"])
    assert taken["held_out"] == figures["held_out"]["mean"]
    measurement, fit = (figures["coverage"][name] for name in ("measurement", "fit"))
    assert (measurement["nominal"], measurement["count"]) == (0.95, 3 * figures["readings"])
    assert 0.8 < measurement["share"] <= 1.0
    assert fit["share"] is None
    assert "the true deflection is not measured" in fit["reason"]


@pytest.mark.slow
def test_calibrate_json_has_the_contract_keys_and_nothing_else_on_standard_output(folder):
    result = elastocal("calibrate", folder / "data.nc", "--out", folder / "again.json", "--json")
    figures = json.loads(result.out)
    assert set(figures) >= KEYS
    assert result.err == ""
    assert set(figures["springs"][0]) >= {"name", "kind", "compliance", "low", "high", "observable"}
    assert set(figures["residual"]) >= {"mean", "max", "p95"}
    assert figures["springs_total"] == len(figures["springs"]) == 18


def test_calibrate_twice_gives_the_same_file(folder):
    elastocal("calibrate", folder / "data.nc", "--out", folder / "again.json")
    assert (folder / "again.json").read_text() == (folder / "model.json").read_text()


def test_a_spring_file_replaces_a_layout(folder):
    out = folder / "custom.json"
    result = elastocal(
        "calibrate",
        folder / "data.nc",
        "--out",
        out,
        "--json",
        "--springs",
        folder / "springs.yaml",
    )
    assert [spring["name"] for spring in json.loads(result.out)["springs"]][-1] == "joint_2.x"


def test_predict_adds_the_deflection_with_its_interval_and_keeps_the_rest(folder):
    out = folder / "predicted.csv"
    result = elastocal("predict", folder / "model.json", folder / "rows.csv", "--out", out)
    assert result.code == 0, result.err
    header = out.read_text().splitlines()[0].split(",")
    assert header[0] == "note"
    assert header[-17:-14] == ["deflection_x[m]", "deflection_y[m]", "deflection_z[m]"]
    truth = unseen(linear_truth()).deflection
    found = columns(out, *(f"deflection_{axis}[m]" for axis in "xyz"))
    low = columns(out, *(f"deflection_{axis}_low[m]" for axis in "xyz"))
    high = columns(out, *(f"deflection_{axis}_high[m]" for axis in "xyz"))
    assert (
        np.linalg.norm(found - truth, axis=1).mean() < 0.05 * np.linalg.norm(truth, axis=1).mean()
    )
    assert np.all(low < high)
    assert np.mean((low <= truth) & (truth <= high)) > 0.75
    widest = columns(out, *(f"deflection_{axis}_measured_high[m]" for axis in "xyz"))
    assert np.all(widest >= high)


def test_predict_says_which_rows_lie_outside_of_what_was_calibrated(folder):
    lines = (folder / "rows.csv").read_text().splitlines()
    names = lines[0].split(",")
    far, heavy = lines[1].split(","), lines[2].split(",")
    far[1] = str(float(far[1]) + 2.5)
    for axis in "xyz":
        heavy[names.index(f"force_{axis}[N]")] = "4000"
    rows, out = folder / "far.csv", folder / "far_out.csv"
    rows.write_text("\n".join([lines[0], ",".join(far), ",".join(heavy)]) + "\n")
    result = elastocal("predict", folder / "model.json", rows, "--out", out)
    assert result.err.count("0% of 2 rows given lie within 30 deg in each joint but the last") == 1
    assert "first: row 2 of the file; no interval covers the others" in " ".join(result.err.split())
    assert columns(out, "outside_pose", "outside_load")[:, 1].tolist()[1] == 1.0
    assert columns(out, "outside_pose")[0].tolist() == [1.0]
    figures = elastocal("predict", folder / "model.json", rows, "--out", out, "--json")
    coverage = json.loads(figures.out)["coverage"]
    assert (coverage["rows"], coverage["covered"], coverage["first"]) == (
        2,
        0.0,
        "row 2 of the file",
    )


def test_rows_of_a_visit_share_what_friction_remembers_and_every_row_is_of_one(tmp_path):
    write_model(tmp_path / "model.json", geared())
    write_rows(tmp_path / "rows.csv")
    header, *rows = (tmp_path / "rows.csv").read_text().splitlines()
    visits = [f"{number // 4}" for number in range(len(rows))]
    lines = [f"visit,{header}", *(",".join(pair) for pair in zip(visits, rows, strict=True))]
    (tmp_path / "visits.csv").write_text("\n".join(lines) + "\n")
    found = {}
    for name in ("rows", "visits"):
        arguments = (tmp_path / "model.json", tmp_path / f"{name}.csv")
        assert elastocal("predict", *arguments, "--out", tmp_path / f"{name}_out.csv").code == 0
        names = (f"deflection_{axis}[m]" for axis in "xyz")
        found[name] = columns(tmp_path / f"{name}_out.csv", *names)
    off = np.linalg.norm(found["visits"] - found["rows"], axis=1)
    assert off[::4].max() < 1e-12
    assert off.max() > 1e-6
    assert (tmp_path / "visits_out.csv").read_text().startswith("visit,")
    lines[3] = lines[3].replace("0,", " ,", 1)
    (tmp_path / "visits.csv").write_text("\n".join(lines) + "\n")
    refused = elastocal("predict", *arguments, "--out", tmp_path / "out.csv")
    assert refused.code == 1
    assert "row 4, column 'visit': empty, but every row is of some visit" in refused.reason
    (tmp_path / "visits.csv").write_text("\n".join(["Visits" + lines[0][5:], *lines[1:]]) + "\n")
    refused = elastocal("predict", *arguments, "--out", tmp_path / "out.csv")
    assert "column 'Visits' is written 'visit'" in refused.reason


def test_predict_with_a_model_that_does_not_know_its_misfit_says_what_is_missing(folder):
    data = json.loads((folder / "model.json").read_text()) | {"misfit": None}
    del data["content_sha256"]
    (folder / "older.json").write_text(json.dumps(data))
    out = folder / "older.csv"
    result = elastocal("predict", folder / "older.json", folder / "rows.csv", "--out", out)
    assert result.code == 0
    assert "calibrate again" in result.err
    assert "measured" not in out.read_text().splitlines()[0]


def test_predict_reads_degrees_and_kilonewtons_by_their_header(folder):
    write_rows(folder / "degrees.csv", "deg", "kN", 1e-3)
    outs = []
    for rows in ("rows.csv", "degrees.csv"):
        out = folder / f"predicted_{rows}"
        elastocal("predict", folder / "model.json", folder / rows, "--out", out)
        outs.append(columns(out, "deflection_x[m]", "deflection_z[m]"))
    np.testing.assert_allclose(outs[0], outs[1], rtol=1e-9)


@pytest.mark.parametrize(
    ("find", "replace", "message"),
    [
        ("force_x[N]", "force_x", "no unit"),
        ("force_x[N]", "force_x[m]", "not a force"),
        ("joint_3[rad]", "joint_9[rad]", "joint_3"),
        ("force_y[N]", "force_x[N]", "twice"),
        ("row 7,", "row 7,x", "row 9, column 'joint_1[rad]'"),
        ("row 7,", "row 7,nan", "row 9"),
        ("row 7,", "row 7,57", "bad.csv: row 9, column 'joint_1[rad]': 57 rad is not within -3.2"),
        ("row 7,", "row 7,57", " rad, about the limits of the joint: is it in degrees?"),
        ("row 7,", "row 7,1e300", "1e+300 rad is not within"),
    ],
)
def test_predict_refuses_a_bad_row_by_name(folder, find, replace, message):
    text = (folder / "rows.csv").read_text()
    if find.startswith("row"):
        line = next(line for line in text.splitlines() if line.startswith(find))
        cells = line.split(",")
        cells[1] = replace.split(",")[1]
        text = text.replace(line, ",".join(cells))
    else:
        text = text.replace(find, replace)
    (folder / "bad.csv").write_text(text)
    out = folder / "refused.csv"
    reason = elastocal("predict", folder / "model.json", folder / "bad.csv", "--out", out).reason
    assert message in reason
    assert not out.exists()


@pytest.mark.parametrize("force", ["1e7", "-1e300", "1e309"])
def test_predict_and_compare_refuse_a_force_that_no_robot_feels(folder, force, recwarn):
    header, row, *_ = (folder / "rows.csv").read_text().splitlines()
    (folder / "bad.csv").write_text(f"{header}\n{row.rpartition(',')[0]},{force}\n")
    out = folder / "refused.csv"
    predicted = elastocal("predict", folder / "model.json", folder / "bad.csv", "--out", out)
    model = folder / "model.json"
    compared = elastocal("compare", model, model, "--rows", folder / "bad.csv")
    for reason in (predicted.reason, compared.reason):
        assert "bad.csv: row 2" in reason
        assert "force_z" in reason
    assert not out.exists()
    assert not recwarn.list


def test_rows_a_little_beyond_the_limits_of_a_drawing_are_predicted(folder):
    header, row, *_ = (folder / "rows.csv").read_text().splitlines()
    high = float(robot().limits.upper[0]) + 0.05
    note, _, rest = row.split(",", 2)
    (folder / "edge.csv").write_text(f"{header}\n{note},{high!r},{rest}\n")
    out = folder / "edge_out.csv"
    assert elastocal("predict", folder / "model.json", folder / "edge.csv", "--out", out).code == 0


@pytest.mark.parametrize("name", ["data.nc", "model.json", "arm.urdf", "springs.yaml"])
def test_check_says_what_a_good_file_is(folder, name):
    result = elastocal("check", folder / name, "--json")
    assert result.code == 0, result.err
    assert json.loads(result.out)["kind"]
    assert "ok" in elastocal("check", folder / name).err


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.txt", "x", "suffix '.txt'"),
        ("missing.nc", None, "cannot read"),
        ("a.nc", "not netcdf", "a.nc"),
        ("a.json", "{", "not valid JSON"),
        ("a.json", '{"schema": "elastocal.model/7"}', "elastocal.model/7"),
        ("a.json", '{"schema": "elastocal.model/1"}', "robot"),
        (
            "a.json",
            '{"a": "' + 300 * "b" + '", "schema": "elastocal.plan/9"}',
            "'elastocal.plan/2'",
        ),
        ("a.json", '{"schema": "elastocal.modle/1"}', "did you mean 'elastocal.model'? (known: "),
        (
            "a.json",
            "{}",
            "states no schema (known: elastocal.arm-state, elastocal.codec_verdicts, ",
        ),
        ("a.json", "[" * 100_000, "not valid JSON: its brackets are nested too deeply"),
        ("a.json", '{"a": ' + 5000 * "9" + "}", "JSON: it holds a number of thousands of digits"),
        (
            "a.json",
            '{"schema": "elastocal.model/1", "a": [' + 2_000_001 * "0," + "0]}",
            "JSON_VALUES",
        ),
        ("a.json", '{"schema": [[1, 2]]}', "states no schema (known: "),
        ("a.yaml", "schema: elastocal.spring/1\n", "did you mean 'elastocal.springs'? (known: "),
        ("a.yaml", "robot: x\n", "states no schema (known: elastocal.catalogue, elastocal.cell"),
        ("a.yaml", "a: [1\nb: 2", "while parsing a flow sequence line 1, column 4"),
        ("a.urdf", "<robot><link/></robot>", "a.urdf: URDF: link 1 of the file has no name"),
        ("a.jsonl", "no json\n", "a.jsonl: line 1 is not valid JSON"),
        ("a.urdf", "<robot>", "not valid XML"),
        ("a.yaml", "schema: elastocal.springs/1\nspings: []\n", "did you mean 'springs'"),
        ("a.yaml", "schema: elastocal.springs/1\nsprings: [{joint: j, axis: w}]\n", "springs.0"),
        ("a.yaml", ":\n  - ]", "not valid YAML"),
    ],
)
def test_check_refuses_a_bad_file_by_name(tmp_path, name, text, message):
    if text is not None:
        (tmp_path / name).write_text(text)
    assert message in elastocal("check", tmp_path / name).reason


def test_a_model_whose_robot_was_edited_is_refused(folder):
    text = (folder / "model.json").read_text().replace("0.675", "0.685", 1)
    (folder / "edited.json").write_text(text)
    out = folder / "none.csv"
    result = elastocal("predict", folder / "edited.json", folder / "rows.csv", "--out", out)
    assert "hash" in result.reason


def test_usage_mistakes_exit_with_2():
    assert elastocal("calibrate").code == 2
    assert elastocal("calibrat").code == 2
    assert elastocal("predict", "--nonsense").code == 2
    refused = elastocal("study", "a.yaml", "--out", "b", "--seed", "1_0")
    assert refused.code == 2
    assert "'1_0' is not a number" in refused.err


def test_help_and_version_load_no_numerical_library():
    code = (
        "import sys; sys.argv = ['elastocal', '--help']\n"
        "from elastocal.cli.main import run\n"
        "try: run()\n"
        "except SystemExit: pass\n"
        "heavy = {'numpy', 'scipy', 'pinocchio', 'xarray', 'pydantic'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "calibrate" in done.stdout


@pytest.mark.slow
def test_calibrate_takes_the_marker_of_the_dataset_unless_told_otherwise(folder, tmp_path):
    data = dataset.read(folder / "data.nc").to_xarray().copy(deep=True)
    data.attrs["marker"] = "0.0 m, 0.03 m, -0.02 m"
    dataset.write(dataset.Dataset.from_xarray(data), tmp_path / "marked.nc")

    def residual(*options: str) -> dict[str, float]:
        out = tmp_path / "m.json"
        result = elastocal("calibrate", tmp_path / "marked.nc", "--out", out, "--json", *options)
        assert result.code == 0, result.err
        return json.loads(result.out)["residual"]

    told = residual("--marker", "0 mm, 30 mm, -20 mm")
    assert residual() == told
    assert residual("--marker", "0 mm, 0 mm, 0 mm") != told


def test_a_dataset_whose_schema_is_no_text_states_none(folder, tmp_path):
    shutil.copy(folder / "data.nc", tmp_path / "data.nc")
    with h5py.File(tmp_path / "data.nc", "r+") as file:
        file.attrs["schema"] = np.array([1.0, 2.0])
    assert "states no schema" in elastocal("check", tmp_path / "data.nc").reason


def test_every_number_of_repetitions_has_a_bound():
    """Draws, splits, poses: a seed may be any number, and rates are judged by their command."""
    program = typer.main.get_command(main.app)
    counts = {
        f"{name} {each.name}": each.max
        for name in COMMANDS
        for each in program.get_command(None, name).params
        if "int" in re.findall(r"\bint\b", str(each.type_descriptor.annotation))
        and not each.name.startswith("seed")
    }
    assert len(counts) > 12
    assert [name for name, most in counts.items() if most is None] == []


@pytest.mark.slow
def test_the_folder_of_a_run_stands_for_its_dataset(tmp_path):
    run = reported.finished() / "run"
    made = [
        elastocal("calibrate", source, "--springs", "actuated", "--draws", 40, "--out", out)
        for source, out in ((run, tmp_path / "a.json"), (run / "dataset.nc", tmp_path / "b.json"))
    ]
    assert [each.code for each in made] == [0, 0]
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()


@pytest.mark.parametrize(
    ("journal", "message"),
    [
        (None, "the folder is no run: allowed are a dataset (.nc, .csv) and the folder of a run"),
        ("", "the run has no dataset: `elastocal derive {folder}` makes it of its record"),
    ],
)
def test_a_folder_without_a_dataset_is_refused(tmp_path, journal, message):
    folder = tmp_path / "run"
    folder.mkdir()
    if journal is not None:
        RunFolder(folder).journal.write_text(journal)
    done = elastocal("calibrate", folder, "--out", tmp_path / "model.json")
    assert done.code == 1
    assert done.err.strip() == f"elastocal: {folder}: {message.format(folder=folder)}"
