"""``--tool``: every command that uses a model works at another tool's tcp, and says so."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from elastocal.elastic import ElasticModel
from elastocal.identification import read_model, write_model
from elastocal.robot import T_from_xyzabc
from elastocal.workflows._inputs import coverage_notes
from support.cells import robot
from support.cli import elastocal
from support.geared import geared
from support.paths import (
    FORCE_TCP,
    calibrated,
    dome_course,
    euler_columns,
    force_columns,
    joint_columns,
    made_up,
    read_csv,
    start_text,
    write_csv,
)
from support.simulated import example_cell
from support.summaries import made_up_summary

LONGER = "0 mm, 0 mm, 100 mm, 0 deg, 0 deg, 0 deg"
SHORTER = "0 mm, 0 mm, -100 mm, 0 deg, 0 deg, 0 deg"
T_LONGER = T_from_xyzabc(0.0, 0.0, 0.1, 0.0, 0.0, 0.0)
TOLD = "another tool than calibrated with: tcp at 0 mm, 0 mm, 100 mm"
COURSE = dome_course(9)
Q = np.radians([[10.0, -80.0, 90.0, 20.0, 50.0, -30.0], [-25.0, -60.0, 100.0, -40.0, 70.0, 80.0]])
FORCE = np.array([[200.0, -100.0, 900.0], [-300.0, 150.0, 600.0]])
DEFLECTION = tuple(f"deflection_{axis}[m]" for axis in "xyz")


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("new_tool")
    write_model(folder / "model.json", calibrated(), made_up_summary())
    force = force_columns(np.tile(FORCE_TCP, (9, 1)), "force_tcp_")
    write_csv(folder / "path.csv", euler_columns(COURSE) | force)
    write_csv(folder / "rows.csv", joint_columns(Q) | force_columns(FORCE))
    return folder


def figures(result) -> dict:
    assert result.code == 0, result.err
    return json.loads(result.out)


def test_predict_is_of_the_new_tcp(folder):
    model, rows, out = folder / "model.json", folder / "rows.csv", folder / "predicted.csv"
    found = elastocal("predict", model, rows, "--out", out, "--tool", LONGER, "--json")
    assert TOLD in figures(found)["tool"]
    expected = read_model(model).with_tool(T_LONGER).predict(Q, FORCE).deflection
    np.testing.assert_allclose(read_csv(out, *DEFLECTION), expected, rtol=1e-9)
    assert TOLD in " ".join(
        elastocal("predict", model, rows, "--out", out, "--tool", LONGER).err.split()
    )


def test_without_the_option_the_summary_names_the_calibrated_tool(folder):
    found = elastocal(
        "predict", folder / "model.json", folder / "rows.csv", "--out", folder / "o.csv", "--json"
    )
    assert figures(found)["tool"].endswith(", as calibrated")


def test_compensate_brings_the_loaded_new_tool_onto_the_path(folder):
    out = folder / "corrected.csv"
    found = elastocal(
        "compensate", folder / "model.json", folder / "path.csv", "--out", out, "--tool", LONGER,
        "--start", start_text(), "--json",
    )  # fmt: skip
    assert TOLD in figures(found)["tool"]
    corrected = read_csv(out, "x[mm]", "y[mm]", "z[mm]") / 1e3
    programmed = read_csv(folder / "path.csv", "x[mm]", "y[mm]", "z[mm]") / 1e3
    np.testing.assert_allclose(corrected + read_csv(out, *DEFLECTION), programmed, atol=2e-8)
    plain = elastocal(
        "compensate", folder / "model.json", folder / "path.csv", "--out", folder / "plain.csv",
        "--start", start_text(), "--json",
    )  # fmt: skip
    assert figures(plain)["deviation"]["mean"] != figures(found)["deviation"]["mean"]


@pytest.mark.slow
def test_stiffness_is_that_of_the_new_tcp(folder):
    def softest(out: str, *tool: object) -> dict:
        return figures(
            elastocal(
                "stiffness", folder / "model.json", folder / "path.csv", "--out", folder / out,
                "--spins", 4, "--stations", 3, "--start", start_text(), "--json", *tool,
            )
        )  # fmt: skip

    changed, plain = softest("longer", "--tool", LONGER), softest("plain")
    assert TOLD in changed["tool"]
    assert TOLD in json.loads((folder / "longer/stiffness.json").read_text())["tool"]
    assert changed["choices"][0]["softest"] != plain["choices"][0]["softest"]


def test_the_exported_c_names_the_tool(folder):
    found = elastocal(
        "export", folder / "model.json", "--c", folder / "c", "--tool", LONGER,
        "--tool-mass", "12 kg", "--tool-centre", "0 mm, 0 mm, -50 mm", "--json",
    )  # fmt: skip
    assert TOLD in figures(found)["tool"]
    head = (folder / "c/elastocal_model.c").read_text()[:3000]
    assert TOLD in " ".join(head.replace("\n *", " ").split())
    assert "12 kg" in head


@pytest.mark.slow
def test_a_process_is_simulated_with_the_cells_tool_by_a_model_of_another_one(folder):
    cell = example_cell("afp")
    other = made_up(cell.robot).with_tool(T_from_xyzabc(0.0, 0.0, -0.1, 0.0, 0.0, 0.0))
    write_model(folder / "other.json", other)

    def run(out: str, *tool: object):
        return elastocal(
            "simulate-process", cell.path, "--process", "afp", "--model", folder / "other.json",
            "--out", folder / out, "--courses", 1, "--json", *tool,
        )  # fmt: skip

    assert "mm apart in the model" in run("refused").reason
    assert "tcp, as calibrated" not in figures(run("process", "--tool", LONGER))["tool"]


@pytest.mark.parametrize(
    ("given", "why"),
    [
        (("--tool", "0 mm, 0 mm, 100 mm"), "must be six quantities"),
        (("--tool", "0, 0, 100, 0, 0, 0"), "'0'"),
        (("--tool-mass", "3 kg"), "a tool's mass needs its tcp"),
        (("--tool", LONGER, "--tool-mass", "3 kg"), "both a mass and a centre"),
        (("--tool", LONGER, "--tool-mass", "3 mm"), "unit 'mm'"),
        (("--tool", LONGER.replace("100 mm", "100 m")), "tcp lies 100 m from the calibrated one"),
        (
            ("--tool", LONGER, "--tool-mass", "3 kg", "--tool-centre", "0 m, 80 m, 0 m"),
            "centre of mass lies 80 m from its tcp",
        ),
    ],
)
def test_a_tool_that_is_not_understood_is_refused_in_one_line(folder, given, why):
    found = elastocal(
        "predict", folder / "model.json", folder / "rows.csv", "--out", folder / "no.csv", *given
    )
    assert why in found.reason
    assert not (folder / "no.csv").exists()


def test_a_compensator_for_two_tools_is_refused(folder):
    found = elastocal(
        "export", folder / "model.json", "--c", folder / "two", "--tool", LONGER, "--tool", SHORTER
    )
    assert "--tool names 2 tcps" in found.reason


def test_a_tools_mass_that_preloads_the_gears_of_an_arm_without_masses_is_told():
    tool = (T_LONGER, 20.0, (0.0, 0.0, -0.1))
    heavy = geared()
    bare = replace(heavy, model=ElasticModel(robot(), heavy.model.springs))
    (note,) = [each for each in coverage_notes(bare.with_tool(*tool)) if "gears were" in each]
    assert note.startswith("only what the last joint carries has a mass")
    assert not any("gears were" in each for each in coverage_notes(heavy.with_tool(*tool)))
    assert not any("gears were" in each for each in coverage_notes(bare.with_tool(T_LONGER)))
