"""What a review with fresh eyes broke, and how it is met now."""

import json

import numpy as np
import pytest

from elastocal import dataset
from elastocal.elastic import ElasticModel, layout
from elastocal.errors import RobotError
from elastocal.identification import FitOptions, attainable_rank, calibrate
from elastocal.robot import Robot
from support.by_day import some_by_day
from support.cells import TRACKED, Cell, linear_truth, robot, urdf
from support.cli import elastocal


@pytest.fixture
def data(tmp_path):
    path = tmp_path / "data.nc"
    dataset.write(Cell(linear_truth(), poses=12, noise=TRACKED).measure(), path)
    return path


def model() -> ElasticModel:
    return ElasticModel(robot(), layout(robot(), "bearing"))


def few(poses: int, case: str = "normal"):
    return Cell(linear_truth(), poses=poses, seed=poses).measure().select(load_cases=[case])


def test_measurements_are_not_replaced_by_a_model(data):
    before = data.read_bytes()
    assert "is an input" in elastocal("calibrate", data, "--out", data).reason
    assert data.read_bytes() == before


def test_missing_poses_are_told_from_what_no_pose_would_show():
    readings = few(4).readings(robot().joint_names)
    calibration = calibrate(model(), readings, np.random.default_rng(0))
    assert calibration.calibrated.observability.rank < calibration.attainable_rank
    assert any("predictions elsewhere are not covered" in text for text in calibration.warnings)
    assert not any("constant" in text for text in calibration.warnings)


@pytest.mark.slow
def test_all_load_cases_at_twelve_poses_reach_what_can_be_reached(data):
    result = elastocal("calibrate", data, "--out", data.with_suffix(".json"), "--json")
    figures = json.loads(result.out)
    assert figures["rank"] == figures["rank_attainable"] == attainable_rank(model())
    # The arm of these data has no masses, which is said.
    assert [text for text in figures["warnings"] if "has a mass" not in text] == []


@pytest.mark.slow
@pytest.mark.parametrize("bounds", some_by_day(["0,0", "1e-9,2e-9", "1,2"]))
def test_bounds_that_leave_the_data_no_part_are_refused(data, bounds):
    out = data.with_suffix(".json")
    assert "bound" in elastocal("calibrate", data, "--out", out, "--bounds", bounds).reason


@pytest.mark.slow
def test_every_spring_is_observable_stands_in_a_group_or_is_too_weak_to_see():
    for poses in (3, 4, 6, 10):
        readings = few(poses).readings(robot().joint_names)
        seen = calibrate(model(), readings, np.random.default_rng(0)).calibrated.observability
        grouped = {term.spring for group in (*seen.unobservable, *seen.hidden) for term in group}
        weak = {each.name for each in seen.faint}
        for name, observable in zip(model().spring_names, seen.observable, strict=True):
            assert observable != (name in grouped | weak)


def test_what_fits_without_redundancy_gets_no_score():
    readings = few(4).readings(robot().joint_names)
    assert calibrate(model(), readings, np.random.default_rng(0)).screening.score.max() == 0.0


def test_trusted_conventions_are_fitted_with_the_doubt_in_the_model():
    readings = Cell(linear_truth(), poses=12).readings()
    turned = type(readings)(
        **{name: getattr(readings, name) for name in readings.__dataclass_fields__}
        | {"joint_position": readings.joint_position * [-1, 1, 1, -1, 1, -1], "tcp_position": None}
    )
    options = FitOptions(trust_conventions=True)
    warnings = calibrate(model(), turned, np.random.default_rng(0), options).warnings
    assert any("in spite of this: joints 1, 4 and 6" in warning for warning in warnings)


@pytest.mark.slow
def test_names_that_look_like_markup_are_shown_as_they_are(tmp_path):
    measured = Cell(linear_truth(), poses=12).measure()
    arrays = {name: getattr(measured, name) for name in ("joint_position", "force")}
    moved = ("controller_displacement", "marker_displacement")
    arrays |= {name: getattr(measured, name) for name in moved}
    odd = dataset.Dataset.from_arrays(
        **arrays,
        joint_names=robot().joint_names,
        load_cases=["[bold]a[/x]", "b", "c", "d", "e"],
        robot_urdf=urdf().replace('name="arm"', 'name="[red]x[/blue]"', 1),
        tcp_frame="tcp",
    )
    dataset.write(odd, tmp_path / "odd.nc")
    result = elastocal("calibrate", tmp_path / "odd.nc", "--out", tmp_path / "odd.json")
    assert result.code == 0, result.err
    assert "[red]x[/blue]" in result.err


@pytest.mark.parametrize(
    ("find", "replace", "message"),
    [
        ('xyz="0.35 0.0 0.675"', 'xyz="0.35 a 0.675"', "origin xyz='0.35 a 0.675'"),
        ('xyz="0.35 0.0 0.675"', 'xyz="0.35 nan 0.675"', "3 finite numbers"),
        ('xyz="0.35 0.0 0.675"', 'xyz="${pi/2} 0 0"', "is a xacro template"),
        ('axis xyz="0 1 0"', 'axis xyz="0 0 0"', "must not be zero"),
        ('effort="0"', 'effort="strong"', "a finite number"),
        ('<link name="link_2"/>', '<link name="link_1"/>', "two links named 'link_1'"),
        ('<parent link="link_1"/>', '<parent link="link_x"/>', "no link 'link_x'"),
    ],
)
def test_a_urdf_is_refused_before_the_parser_speaks(capfd, find, replace, message):
    assert find in urdf()
    with pytest.raises(RobotError, match=message.replace("[", r"\[")):
        Robot.from_urdf(urdf().replace(find, replace, 1), "tcp")
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    "force", [np.ones((2, 2)), np.float64(1.0), [[np.nan, 0.0, 0.0]], [np.inf, 0.0, 0.0]]
)
def test_forces_of_another_form_are_refused_by_name(force):
    with pytest.raises(ValueError, match="force"):
        model().deflection(np.full(18, 1e-6), np.zeros((2, 6)), force)
