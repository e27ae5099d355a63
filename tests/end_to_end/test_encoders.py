"""Secondary encoders from the cell file to the C that corrects, by the commands of a user."""

import json
import shutil

import numpy as np
import pytest

from elastocal.compensation import process
from elastocal.dataset import read
from support.cli import elastocal
from support.compiled import CompiledCorrector
from support.exported import needs_gcc
from support.kept import kept
from support.run_cells import planned_cell

ENCODERS = r"\n  preset: .*", "\n  preset: kind\n  encoders: {noise: 2e-6 rad}"


@pytest.fixture(scope="module")
def story(tmp_path_factory):
    """Return a folder with a cell with encoders, its run, and the model calibrated with them."""
    return shutil.copytree(kept("encoders", _make), tmp_path_factory.mktemp("encoders") / "story")


def _make(folder):
    planned = planned_cell(folder, 5, "afp", (r"\n  preset: kind", ENCODERS[1]))
    run = folder / "run"
    done("run", planned.cell, "--plan", planned.plan, "--out", run, "--seed", 1)
    done("calibrate", run, "--springs", "bearing", "--out", folder / "model.json")


def done(*arguments):
    said = elastocal(*arguments)
    assert said.code == 0, said.err
    return said.out


def processed(story, out, *options):
    """Return the lines of a simulated course, as `simulate-process --json` has them."""
    cell, model = story / "cell" / "cell.yaml", story / "model.json"
    told = done(
        "simulate-process", cell, "--model", model, "--process", "afp", "--courses", 1,
        "--jobs", 1, "--json", "--out", out, *options,
    )  # fmt: skip
    return json.loads(told)["lines"]


@pytest.mark.slow
def test_a_run_records_what_gears_yield_by(story):
    data = read(story / "run" / "dataset.nc")
    arm = slice(data.joint_names.index("joint_a1"), None)
    assert np.all(np.isnan(data.link_joint_position[..., : arm.start]))
    moved = data.link_joint_position - data.joint_position
    moved -= (data.reference_link_joint_position - data.reference_joint_position)[:, None]
    assert 5e-5 < np.abs(moved[..., arm]).max() < 5e-3
    found = json.loads((story / "model.json").read_text())["calibration"]["encoders"]
    assert found["joints"] == list(data.joint_names[arm])


@pytest.mark.slow
@needs_gcc
def test_the_exported_c_with_encoders_closes_the_loop(story, tmp_path, monkeypatch):
    """Simulator, C step, drives, and the deviation that is left: the figures are Python's."""
    model_alone = processed(story, tmp_path / "model alone")
    by_python = processed(story, tmp_path / "python", "--encoders")
    made = []

    def compiled(compensator):
        made.append(CompiledCorrector(compensator, tmp_path / f"c{len(made)}"))
        return made[-1]

    monkeypatch.setattr(process, "ModelCorrector", compiled)
    by_c = processed(story, tmp_path / "c", "--encoders")
    assert made
    for one, other in zip(by_python, by_c, strict=True):
        for when in ("before", "after"):
            assert other[when] == pytest.approx(one[when], rel=0, abs=1e-12)
    first = by_c[0]
    assert first["after"]["mean"] < 0.5 * first["before"]["mean"]
    # And the links are in it: the model alone leaves something else of the same course.
    assert first["before"] == model_alone[0]["before"]
    assert abs(first["after"]["mean"] - model_alone[0]["after"]["mean"]) > 1e-7


@pytest.mark.slow
def test_a_cell_without_encoders_refuses_to_read_them(tmp_path):
    planned = planned_cell(tmp_path, 4)
    folder = planned.cell.parent
    run = ("run", planned.cell, "--plan", planned.plan, "--out", folder / "run", "--seed", 1)
    assert elastocal(*run).code == 0
    model = folder / "model.json"
    assert elastocal("calibrate", folder / "run" / "dataset.nc", "--out", model).code == 0
    shutil.rmtree(folder / "run")
    said = elastocal("simulate-process", planned.cell, "--model", model, "--process", "afp",
                     "--encoders", "--out", folder / "process")  # fmt: skip
    assert said.code == 1
    assert "has no secondary encoders (key simulation.encoders.noise)" in said.err
