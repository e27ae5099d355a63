"""A run that presses before its reference, reads it in light contact, and keeps a level aside."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import elastocal as ec
from elastocal.cell import load_cell
from elastocal.codec import CodecOptions, cross_validate, make_variants
from elastocal.dataset import Dataset, merge, read
from elastocal.errors import ProcedureError
from elastocal.planning import make_plan, read_plan, write_plan
from elastocal.procedure import check_compatible
from elastocal.procedure.record import read_commits
from support.cli import elastocal
from support.run_cells import planned_cell

pytestmark = pytest.mark.slow

ORDER = (
    "conditioning", "light_contact", "normal_45", "normal", "north", "normal_75", "normal_45_back",
)  # fmt: skip
POSES = 6
READ = tuple(name for name in ORDER if name != "light_contact")


def with_reference(cell: Path, name: str = "conditioned.yaml") -> Path:
    """Write the cell with everything that belongs to the reference switched on."""
    text = cell.read_text(encoding="utf-8")
    text = re.sub(r"\n  (level|check): .*", "", text)
    text = re.sub(r"\nprocedure:\n(  .*\n)*", "\n", text)
    text = re.sub(r"\n  cases: .*", r"\g<0>\n  level: 0.45\n  check: 0.75", text)
    path = cell.with_name(name)
    section = "procedure: {reference: light_contact, conditioning: true}"
    path.write_text(f"{text}\n{section}\n", encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run, its plan, and its cell."""
    folder = tmp_path_factory.mktemp("reference")
    plain = planned_cell(folder, POSES)
    cell, plan, out = with_reference(plain.cell), folder / "plan_2", folder / "run"
    plan.mkdir()
    write_plan(plan, make_plan(load_cell(cell), None, 1).plan)
    ec.run(cell, plan=plan, out=out)
    return out, plan, cell


@pytest.fixture(scope="module")
def dataset(run) -> Dataset:
    return read(run[0] / "dataset.nc")


def test_the_plan_lists_every_press_in_order(run):
    assert tuple(read_plan(run[1]).contact.load_cases) == ORDER


def test_the_journal_holds_the_presses_in_their_order_in_time(run):
    for log in read_commits(run[0] / "journal.jsonl"):
        windows = [window.load_case for window in log.windows]
        assert windows == [None, *ORDER, None]
        assert all(a.end <= b.start for a, b in zip(log.windows, log.windows[1:], strict=False))


def test_the_dataset_says_what_went_before_the_reference(dataset):
    assert dataset.load_cases == READ
    assert dataset.conditioned
    assert dataset.check_cases == ("normal_75",)
    assert dataset.attributes["schema"] == "elastocal.dataset/2"
    np.testing.assert_array_equal(dataset.order, np.tile(np.arange(6), (POSES, 1)))


def test_the_reference_was_read_under_the_contact_force(dataset):
    size = np.linalg.norm(dataset.reference_force, axis=1)
    np.testing.assert_allclose(size, 60.0, atol=3.0)


def test_displacements_count_from_the_light_contact(dataset):
    """A press of 45 % shows less than its share of the full press: 60 N of both are in the zero."""
    size = np.linalg.norm(dataset.marker_displacement - dataset.controller_displacement, axis=2)
    low, full = (size[:, READ.index(name)] for name in ("normal_45", "normal"))
    assert np.all(low / full < 0.45)


def test_a_plan_without_the_presses_is_refused(run, tmp_path):
    old = planned_cell(tmp_path, POSES)
    with pytest.raises(ProcedureError, match=r"contact\.load_cases are normal, north, those of"):
        check_compatible(read_plan(old.plan), load_cell(run[2]))


def disturbed(dataset: Dataset) -> Dataset:
    """The dataset with every marker of the check half a millimetre off."""
    marker = np.array(dataset.marker_displacement)
    marker[:, dataset.load_cases.index("normal_75")] += 0.5e-3
    return replace(dataset, marker_displacement=marker)


@pytest.fixture(scope="module")
def fits(run, dataset, tmp_path_factory):
    """Calibrations of the dataset, and of the one with a disturbed check."""
    from elastocal.dataset import write

    folder = tmp_path_factory.mktemp("fits")
    write(disturbed(dataset), folder / "off.nc")
    paths = (run[0] / "dataset.nc", folder / "off.nc")
    return [ec.calibrate(path, springs="actuated") for path in paths]


def test_the_check_enters_neither_fit_nor_draws_nor_left_out_errors(fits):
    plain, off = fits
    np.testing.assert_array_equal(plain.calibrated.compliance, off.calibrated.compliance)
    np.testing.assert_array_equal(plain.calibrated.draws, off.calibrated.draws)
    assert plain.calibration.held_out == off.calibration.held_out
    assert plain.calibration.readings == 5 * POSES


def test_the_check_shows_what_is_wrong_with_its_level(fits):
    plain, off = (each.calibration.check for each in fits)
    assert plain.load_cases == ("normal_75",)
    assert plain.readings == POSES
    assert 0.0 < plain.noise < 30e-6
    # Each marker is off by the same vector; errors before it keep it from being its length.
    assert off.mean == pytest.approx(np.sqrt(3.0) * 0.5e-3, abs=2.0 * plain.max)


def test_the_check_enters_no_codec(dataset):
    variants, options = make_variants({"springs": ["actuated"]}), CodecOptions(splits=2)
    robot = ec.Robot.from_urdf(dataset.robot_urdf, dataset.tcp_frame)
    found = [
        cross_validate(robot, each.readings(robot.joint_names), variants, options)
        for each in (dataset, disturbed(dataset))
    ]
    np.testing.assert_array_equal(found[0].error_mean, found[1].error_mean)
    assert "normal_75" not in found[0].load_cases


def test_the_terminal_shows_the_check_beside_its_noise(run, tmp_path):
    out = tmp_path / "m.json"
    shown = elastocal("calibrate", run[0] / "dataset.nc", "--springs", "actuated", "--out", out)
    assert "at normal_75, not fitted" in shown.err
    assert "noise there" in shown.err


def test_merged_datasets_keep_all_checks_out(dataset):
    other = replace(dataset, attributes={**dataset.attributes, "check": "normal_45"})
    assert merge([dataset, other], relabel=True).check_cases == ("normal_75", "normal_45")
