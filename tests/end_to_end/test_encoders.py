"""Secondary encoders from the cell file to the correction, by the commands that a user gives."""

import json
import shutil

import numpy as np

from elastocal.dataset import read
from support.cli import elastocal
from support.run_cells import planned_cell

ENCODERS = r"\n  preset: .*", "\n  preset: kind\n  encoders: {noise: 2e-6 rad}"


def test_a_simulated_cell_with_encoders_is_run_calibrated_and_corrected(tmp_path):
    planned = planned_cell(tmp_path, 5, "afp", (r"\n  preset: kind", ENCODERS[1]))
    folder = planned.cell.parent
    run = ("run", planned.cell, "--plan", planned.plan, "--out", folder / "run", "--seed", 1)
    assert elastocal(*run).code == 0
    data = read(folder / "run" / "dataset.nc")
    arm = slice(data.joint_names.index("joint_a1"), None)
    assert np.all(np.isnan(data.link_joint_position[..., : arm.start]))
    moved = data.link_joint_position - data.joint_position
    moved -= (data.reference_link_joint_position - data.reference_joint_position)[:, None]
    assert 5e-5 < np.abs(moved[..., arm]).max() < 5e-3

    model = folder / "model.json"
    said = elastocal("calibrate", folder / "run" / "dataset.nc", "--springs", "bearing",
                     "--out", model, "--json")  # fmt: skip
    assert said.code == 0
    found = json.loads(said.out)["encoders"]
    assert found["joints"] == list(data.joint_names[arm])
    assert [zero["joint"] for zero in found["zeros"]] == found["joints"]

    simulate = ("simulate-process", planned.cell, "--model", model, "--process", "afp",
                "--courses", 1, "--jobs", 1, "--json")  # fmt: skip
    means = []
    for number, options in enumerate(((), ("--encoders",))):
        said = elastocal(*simulate, *options, "--out", folder / f"process{number}")
        assert said.code == 0, said.err
        (line,) = json.loads(said.out)["lines"][:1]
        means.append(line["after"]["mean"] / line["before"]["mean"])
    assert means[0] != means[1]
    assert means[1] < 0.5


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
