"""What the commands import: counted, since a timer would measure the machine."""

import subprocess
import sys

import numpy as np
import pytest

from elastocal import dataset
from support.cells import Cell, linear_truth, robot

UNUSED = {
    "joblib", "matplotlib", "multiprocessing", "pandas", "plotly", "scipy.interpolate",
    "scipy.ndimage", "scipy.signal", "scipy.stats", "trimesh", "xarray",
}  # fmt: skip
"""Packages that take long to import and that no command here needs: quantiles are in
`scipy.special`, datasets are read through h5py, a calibration runs in one process."""
NUMERICAL = {"coal", "h5py", "numpy", "pinocchio", "pydantic", "scipy", "threadpoolctl", "yaml"}
"""What help can do without, too."""


def imported(code: str) -> set[str]:
    """Return the names of all modules that a fresh interpreter has loaded after running code."""
    told = f"{code}\nimport sys; print('MODULES', *sys.modules)"
    done = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=True)
    return set(done.stdout.rpartition("MODULES ")[2].split())


def of_command(*arguments: object) -> set[str]:
    """Return the same of a command."""
    argv = ["elastocal", *map(str, arguments)]
    return imported(
        f"import sys; sys.argv = {argv}\n"
        "from elastocal.cli.main import run\n"
        "try: run()\n"
        "except SystemExit as end: assert not end.code"
    )


@pytest.mark.slow
def test_a_researcher_imports_the_core_without_what_programs_for_people_are_made_of():
    core = ("robot", "elastic", "dataset", "identification", "geometry", "cell", "planning")
    code = "import importlib\n" + "\n".join(
        f"m = importlib.import_module('elastocal.{name}'); [getattr(m, each) for each in dir(m)]"
        for name in (*core, "codec", "compensation")
    )
    people = {"typer", "rich", "jinja2", "matplotlib", "plotly", "websockets", "openpyxl"}
    others = {f"elastocal.{name}" for name in ("sim", "drivers", "procedure", "workflows", "cli")}
    assert not imported(code) & (people | others)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a dataset, and rows to predict."""
    folder = tmp_path_factory.mktemp("startup")
    dataset.write(Cell(linear_truth(), poses=12).measure(), folder / "data.nc")
    names = [*(f"{name}[rad]" for name in robot().joint_names), *(f"force_{a}[N]" for a in "xyz")]
    zeros = ",".join(map(str, np.zeros(len(names))))
    (folder / "rows.csv").write_text(f"{','.join(names)}\n{zeros}\n")
    return folder


@pytest.mark.slow
def test_calibrate_and_predict_import_only_what_they_use(folder):
    calibrate = of_command("calibrate", folder / "data.nc", "--out", folder / "model.json")
    assert not calibrate & UNUSED
    assert len(calibrate) <= 1100
    rows = ("predict", folder / "model.json", folder / "rows.csv", "--out", folder / "out.csv")
    predict = of_command(*rows)
    assert not predict & (UNUSED | {"h5py"})
    assert len(predict) <= 1050


@pytest.mark.slow
def test_no_command_imports_the_statistics_and_filters_of_scipy_before_it_needs_them():
    code = (
        "import elastocal.workflows as w, elastocal.cli._operator, elastocal.cell, elastocal.sim\n"
        "[getattr(each, name) for each in (w, elastocal.cell, elastocal.sim) for name in dir(each)]"
    )
    assert not imported(code) & {"scipy.stats", "scipy.signal"}


def test_help_imports_nothing_numerical():
    found = of_command("--help")
    assert not found & (UNUSED | NUMERICAL)
    assert len(found) <= 420


def test_the_package_imports_nothing_before_it_is_used():
    found = imported("import elastocal")
    assert not found & (UNUSED | NUMERICAL | {"typer", "rich"})
    assert len(found) <= 120


def test_the_package_is_the_program_where_no_script_is_on_the_path():
    ran = subprocess.run([sys.executable, "-m", "elastocal", "--version"], capture_output=True)
    assert (ran.returncode, ran.stdout.split()[0]) == (0, b"elastocal")
