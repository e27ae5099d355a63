"""Rows of joints with forces: read by one rule in every command, written without any NaN."""

import json
from pathlib import Path

import numpy as np
import pytest

from elastocal.cell import ProcessFile, read_production
from elastocal.compensation.offline import CorrectionSettings, compensate_path
from elastocal.compensation.process import PathTiming, read_programmed_path
from elastocal.dataset import PathTable, find_columns, new_rows
from elastocal.errors import PathError
from elastocal.identification import write_model
from elastocal.workflows.check import describe_file
from support.cli import elastocal
from support.geared import geared
from support.paths import dome_course, euler_columns, read_csv, start_text

ROBOT = geared().model.robot
NAMES = [*(f"{name}[rad]" for name in ROBOT.joint_names), *(f"force_{axis}[N]" for axis in "xyz")]
JOINTS = np.array([0.0, -1.0, 1.2, 0.1, 0.8, 0.0]) + np.linspace(0.0, 0.3, 30)[:, None]
FORCES = np.tile([40.0, -30.0, 700.5], (30, 1))


@pytest.fixture(scope="module")
def model(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("rows") / "model.json"
    write_model(path, geared())
    return path


def written(path: Path, changed: dict[str, str] | None = None, row: int = 4) -> Path:
    """Write the rows; some cells of one otherwise."""
    cells = [[repr(float(value)) for value in each] for each in np.hstack([JOINTS, FORCES])]
    for name, text in (changed or {}).items():
        cells[row][NAMES.index(name)] = text
    path.write_text("\n".join(",".join(each) for each in [NAMES, *cells]) + "\n")
    return path


def readers(model: Path, rows: Path) -> dict[str, str]:
    """Return why each command refuses rows."""
    home, held, out = np.zeros(6), np.zeros((1, 0)), rows.with_name("out.csv")
    found = {
        "predict": elastocal("predict", model, rows, "--out", out, "--json").reason,
        "compare": elastocal("compare", model, model, "--rows", rows).reason,
        "compensate": elastocal("compensate", model, rows, "--out", out).reason,
    }
    for name, read in (
        ("simulate-process", lambda: read_programmed_path(rows, ROBOT, PathTiming(0.05))),
        ("plan", lambda: read_production(rows, ProcessFile(file="p.csv"), ROBOT, home, held)),
    ):
        with pytest.raises(PathError) as refusal:
            read()
        found[name] = str(refusal.value)
    return found


@pytest.mark.parametrize(
    ("name", "cell", "why"),
    [
        ("joint_2[rad]", "61.5", "61.5 rad is not within -3.242 to 3.242 rad, about the limits"),
        ("force_z[N]", "1e308", "1e+308 N is not within -1e+05 to 1e+05 N, what a robot can feel"),
        ("force_x[N]", "1e7", "1e+07 N is not within -1e+05 to 1e+05 N"),
        ("force_x[N]", "-1_100", "'-1_100' is not a number"),
        ("force_x[N]", "\u0661\u0662", "'\u0661\u0662' is not a number"),
        ("joint_1[rad]", "nan", "'nan' is not a finite number"),
        ("joint_1[rad]", "1e", "'1e' is not a number"),
    ],
)
def test_what_cannot_be_meant_is_refused_in_the_same_words_everywhere(
    model, tmp_path, recwarn, name, cell, why
):
    rows = written(tmp_path / "p.csv", {name: cell})
    for command, reason in readers(model, rows).items():
        text = " ".join(reason.split())
        assert f"p.csv: row 6, column {name!r}: {why}" in text, command
    if "limits" not in why:
        # Without a robot at hand all but the joints' limits is known.
        with pytest.raises(PathError) as refusal:
            describe_file(rows)
        assert why in str(refusal.value)
    assert not recwarn.list
    assert [path.name for path in tmp_path.iterdir()] == ["p.csv"]


def test_degrees_that_are_called_radians_are_asked_about(model, tmp_path):
    rows = written(tmp_path / "p.csv", {"joint_2[rad]": "-57.0"})
    assert (
        "is it in degrees?" in elastocal("predict", model, rows, "--out", tmp_path / "o.csv").reason
    )


def test_numbers_with_a_decimal_comma_are_read_and_written_where_a_semicolon_parts_cells(
    model, tmp_path
):
    point = written(tmp_path / "point.csv")
    comma = tmp_path / "comma.csv"
    comma.write_text(point.read_text().replace(",", ";").replace(".", ","))
    for command, option in (("predict", ()), ("compensate", ("--start", start_text()))):
        texts = []
        for rows in (point, comma):
            out = tmp_path / f"{command}_{rows.name}"
            assert elastocal(command, model, rows, "--out", out, *option).code == 0
            texts.append(out.read_text())
        assert texts[1].replace(",", ".").replace(";", ",") == texts[0]
    assert describe_file(comma)[1]["rows"] == 30


@pytest.mark.parametrize("cell", ["1,100", "1,1,0", "1.100,5"])
def test_a_comma_that_may_part_thousands_is_refused(model, tmp_path, cell):
    rows = tmp_path / "p.csv"
    text = written(tmp_path / "point.csv").read_text().replace(",", ";")
    lines = text.splitlines()
    lines[5] = ";".join([*lines[5].split(";")[:-1], cell])
    rows.write_text("\n".join(lines) + "\n")
    reason = elastocal("predict", model, rows, "--out", tmp_path / "o.csv").reason
    assert f"row 6, column 'force_z[N]': '{cell}' is not a number (the decimal" in reason


def test_forces_in_the_tcp_frame_are_predicted_for_like_those_in_base(model, tmp_path):
    base = written(tmp_path / "base.csv")
    R = ROBOT.forward(JOINTS)[:, :3, :3]
    turned = np.hstack([JOINTS, np.einsum("rji,rj->ri", R, FORCES)])
    lines = [",".join(map(repr, map(float, row))) for row in turned]
    header = ",".join(NAMES).replace("force_", "force_tcp_")
    (tmp_path / "tcp.csv").write_text("\n".join([header, *lines]) + "\n")
    found = []
    for rows in (base, tmp_path / "tcp.csv"):
        out = tmp_path / f"out_{rows.name}"
        assert elastocal("predict", model, rows, "--out", out).code == 0
        found.append(read_csv(out, "deflection_x[m]", "deflection_z[m]"))
    np.testing.assert_allclose(*found, rtol=1e-9)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_number_that_is_not_finite_is_never_written(tmp_path, bad):
    path = written(tmp_path / "p.csv")
    table = PathTable.open(path, lambda header: find_columns(header, ROBOT))
    numbers = np.zeros((30, 1))
    numbers[7] = bad
    with (
        pytest.raises(PathError, match="row 9: the model gives no finite number"),
        new_rows(tmp_path / "out.csv", table, ("deflection_x[m]",)) as write,
    ):
        write(table.rows(), numbers, ())
    assert not (tmp_path / "out.csv").exists()


def test_largest_loads_that_are_read_give_finite_figures(model, tmp_path):
    rows = written(tmp_path / "p.csv", {"force_x[N]": "1e5", "force_z[N]": "-1e5"})
    figures = json.loads(
        elastocal("predict", model, rows, "--out", tmp_path / "o.csv", "--json").out
    )
    assert np.isfinite(figures["deflection"]["max"])


def test_a_course_without_a_name_is_refused_by_plan_and_simulation_alike(tmp_path):
    text = written(tmp_path / "p.csv").read_text().splitlines()
    lines = ["course," + text[0], *(f"a,{line}" for line in text[1:])]
    lines[3] = lines[3].replace("a,", " ,", 1)
    (tmp_path / "p.csv").write_text("\n".join(lines) + "\n")
    for read in (
        lambda path: read_programmed_path(path, ROBOT, PathTiming(0.05)),
        lambda path: read_production(
            path, ProcessFile(file="p.csv"), ROBOT, np.zeros(6), np.zeros((1, 0))
        ),
    ):
        with pytest.raises(PathError, match="row 4, column 'course': empty, but every row"):
            read(tmp_path / "p.csv")


def test_a_pose_farther_than_any_hall_is_refused_before_it_is_solved(tmp_path):
    columns = euler_columns(dome_course(3))
    lines = [",".join([*columns, *NAMES[6:]])]
    lines += [
        ",".join([*map(repr, map(float, row)), "0", "0", "0"])
        for row in zip(*columns.values(), strict=True)
    ]
    lines[2] = "1e160" + lines[2][lines[2].index(",") :]
    (tmp_path / "p.csv").write_text("\n".join(lines) + "\n")
    with pytest.raises(PathError, match=r"row 3, column 'x\[mm\]': 1e\+160 mm is not within"):
        compensate_path(geared(), tmp_path / "p.csv", tmp_path / "o.csv", CorrectionSettings())


@pytest.mark.parametrize("rows", [[1, 2, 3], None, b"x", 3.0])
def test_rows_that_are_no_columns_are_refused_in_a_line(rows):
    with pytest.raises(PathError, match="they must be a file, a dataset, or columns"):
        PathTable.of(rows, lambda _: None)
