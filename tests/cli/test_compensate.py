"""`elastocal compensate` as a user meets it."""

import json
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from elastocal.identification import write_model
from support.cli import elastocal
from support.paths import (
    FORCE_TCP,
    calibrated,
    dome_course,
    euler_columns,
    force_columns,
    joint_columns,
    read_csv,
    start_text,
    write_csv,
)

COURSE = dome_course(12)
FORCE = force_columns(np.tile(FORCE_TCP, (12, 1)), "force_tcp_")
POSITION = ("x[mm]", "y[mm]", "z[mm]")


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A folder with a model and a path."""
    folder = tmp_path_factory.mktemp("compensate")
    write_model(folder / "model.json", calibrated())
    write_csv(folder / "path.csv", euler_columns(COURSE) | FORCE)
    return folder


def run(folder: Path, *arguments: object, path: str = "path.csv", out: str = "out.csv"):
    return elastocal(
        "compensate", folder / "model.json", folder / path, "--out", folder / out, *arguments
    )


@pytest.mark.slow
def test_it_says_what_was_left_and_what_was_assumed(folder):
    result = run(folder)
    assert result.code == 0, result.err
    assert result.out == ""
    words = " ".join(result.err.split())
    for text in (
        "rows: 12; all figures are predicted",
        "deviation as programmed:",
        "a first-order step would leave:",
        "the correction leaves:",
        "posture nearest to those that were calibrated",
    ):
        assert text in words
    assert "nearest to" not in run(folder, "--start", start_text()).err


def test_a_model_that_does_not_know_what_it_predicts_is_said_to_do_harm(folder):
    model = calibrated()
    sure = model.draws.mean(axis=0)
    write_model(folder / "unsure.json", replace(model, draws=np.outer(np.linspace(0, 9, 50), sure)))
    found = elastocal(
        "compensate", folder / "unsure.json", folder / "path.csv", "--out", folder / "o.csv"
    )
    assert found.code == 0, found.err
    assert "it does not know what it predicts" in " ".join(found.err.split())
    assert "does not know" not in run(folder).err
    doubt = json.loads(run(folder, "--json").out)["doubt"]
    assert doubt["rows"] == 12
    assert 0.0 < doubt["half_width"] < 0.5 * doubt["deflection"]


def test_the_corrected_path_with_its_deflection_is_the_programmed_one(folder):
    run(folder, "--start", start_text())
    corrected = 1e-3 * read_csv(folder / "out.csv", *POSITION)
    deflection = read_csv(folder / "out.csv", *(f"deflection_{axis}[m]" for axis in "xyz"))
    np.testing.assert_allclose(corrected + deflection, COURSE[:, :3, 3], atol=1e-7)


def test_json_is_one_object_and_nothing_else(folder):
    result = run(folder, "--json")
    figures = json.loads(result.out)
    assert result.err == ""
    assert figures["rows"] == 12
    assert figures["residual"]["max"] < 1e-7 < figures["deviation"]["mean"]
    assert len(figures["notes"]) >= 1


def test_forces_that_pull_the_tool_out_are_doubted(folder):
    pulling = {name: -np.asarray(values) for name, values in FORCE.items()}
    write_csv(folder / "pulling.csv", euler_columns(COURSE) | pulling)
    words = " ".join(run(folder, path="pulling.csv", out="pulled.csv").err.split())
    assert "at 12 of 12 rows the force on the robot draws the tool out" in words
    assert "draws the tool out" not in run(folder).err


def test_a_program_is_corrected_with_a_table_of_forces(folder):
    (folder / "out").mkdir()
    line = "DECL FRAME XP1={X 1600.0,Y 0.0,Z 750.0,A 0.0,B -16.699,C 180.0}"
    (folder / "job.src").write_bytes(b"DEF job( )\r\nLIN XP1\r\nEND\r\n")
    (folder / "job.dat").write_bytes(f"DEFDAT job\r\n{line}\r\nENDDAT\r\n".encode())
    write_csv(folder / "forces.csv", {"point": ["XP1"]} | {k: v[:1] for k, v in FORCE.items()})
    start = ("--start", start_text())
    refused = run(folder, *start, path="job.src", out="out/job.src")
    assert "has no forces: name a table of them with --forces" in refused.reason
    forces = ("--forces", folder / "forces.csv")
    result = run(folder, *start, *forces, path="job.src", out="out/renamed.src")
    assert result.code == 0, result.err
    words = " ".join(result.err.split())
    assert "the program inside is job: a controller wants job.src" in words
    assert "$BASE, which the program does not set, is taken for the base of the model" in words
    assert (folder / "out/renamed.src").read_bytes() == (folder / "job.src").read_bytes()
    plain = (folder / "out/renamed.dat").read_bytes()
    result = run(
        folder, *start, *forces, "--base", "0 mm, 0 mm, 1 mm, 0 deg, 0 deg, 0 deg",
        path="job.src", out="out/job.src",
    )  # fmt: skip
    assert "taken for the frame given by --base" in " ".join(result.err.split())
    assert (folder / "out/job.dat").read_bytes() != plain


def test_a_path_is_written_as_a_robot_program_too(folder):
    part = {name: column[:6] for name, column in (euler_columns(COURSE) | FORCE).items()}
    write_csv(folder / "part.csv", part)
    asked = ("--start", start_text(), "--program", "course", "--language", "krl")
    result = run(folder, *asked, path="part.csv", out="part_out.csv")
    assert result.code == 0, result.err
    words = "".join(result.err.split())
    assert f"program:{folder}/course.src,{folder}/course.dat" in words
    assert "programcourse:KRL,asaskedfor" in words
    assert (folder / "course.src").read_text().count("LIN XROW") == 6


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (("--limit", "1 mm"), "row 2: a deflection of 1.1"),
        (("--limit", "-1 mm"), "--limit '-1 mm' must be above 0"),
        (("--start", "0 deg"), "has 1 values"),
        (("--start", ", ".join(["200 deg"] * 6)), "joint_1 at 200 deg is outside its limits"),
        (("--forces", "f.csv"), "are for KUKA programs"),
        (("--program", "course"), "maker of robot"),
        (("--language", "krl"), "needs --program NAME"),
        (("--speed", "0 mm/s"), "must be above 0"),
    ],
)
def test_what_cannot_be_done_is_one_line(folder, arguments, why):
    assert why in run(folder, *arguments).reason


def test_the_kinds_of_path_and_output_must_agree(folder):
    assert "must end in .csv" in run(folder, out="out.src").reason
    assert "is an input of this command" in run(folder, out="path.csv").reason


@pytest.mark.parametrize(
    ("columns", "why"),
    [
        (euler_columns(COURSE), "path has no forces"),
        (euler_columns(COURSE) | joint_columns(np.zeros((12, 6))) | FORCE, "both joints"),
        (euler_columns(COURSE) | FORCE | {"z[mm]": [9000.0] * 12}, "row 2: no posture"),
    ],
)
def test_a_path_that_cannot_be_corrected_is_refused(folder, columns, why):
    write_csv(folder / "bad.csv", columns)
    assert why in run(folder, path="bad.csv", out="bad_out.csv").reason
    assert not (folder / "bad_out.csv").exists()


# Not getrusage(): a process inherits the peak of the one that started it.
_PROGRAM = """
import sys
from elastocal.cli.main import run
sys.argv = ["elastocal", *sys.argv[1:]]
try:
    run()
finally:
    (peak,) = (line for line in open("/proc/self/status") if line.startswith("VmHWM"))
    print("peak", peak.split()[1], file=sys.stderr)
"""


def peak_of(folder: Path, rows: int) -> tuple[float, float]:
    """Correct a path of so many rows in a process of its own; return MB and seconds."""
    with (folder / "long.csv").open("w") as file:
        part = write_csv(folder / "part.csv", columns_of(min(rows, 100_000)))
        header, *lines = part.read_text().splitlines(keepends=True)
        file.write(header)
        for _ in range(rows // len(lines)):
            file.writelines(lines)
            lines.reverse()
    arguments = ["compensate", folder / "model.json", folder / "long.csv"]
    arguments += ["--out", folder / "long_out.csv", "--start", start_text()]
    began = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", _PROGRAM, *map(str, arguments)], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return int(done.stderr.split("peak")[1]) / 1024.0, time.perf_counter() - began


def columns_of(count: int) -> dict[str, object]:
    T = dome_course(count)
    return (
        {"note": ["x"] * count}
        | euler_columns(T)
        | force_columns(np.tile(FORCE_TCP, (count, 1)), "force_tcp_")
    )


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the peak is read from /proc")
def test_a_million_rows_stream_in_bounded_memory(folder):
    small, _ = peak_of(folder, 10_000)
    large, seconds = peak_of(folder, 1_000_000)
    print(f"{1e6 / seconds:.0f} rows/s, peak {large:.0f} MB (10 000 rows: {small:.0f} MB)")
    assert large < small + 50.0
    with (folder / "long_out.csv").open() as file:
        assert sum(1 for _ in file) == 1_000_001


@pytest.mark.parametrize("name", ["weld.as", "weld.pg", "WELD.PG"])
def test_a_program_that_cannot_be_read_is_refused_with_the_way_to_a_corrected_one(folder, name):
    (folder / name).write_text(".PROGRAM weld()\n.END\n")
    done = elastocal("compensate", folder / "model.json", folder / name, "--out", "out.as")
    assert "programs in AS are written, not read (read are .src)" in done.reason
    assert "--program NAME" in done.reason
