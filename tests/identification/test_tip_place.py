"""The place of a tip that is not where the description has it, found beside the springs."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import elastocal as ec
from elastocal.dataset import Dataset
from elastocal.errors import IdentificationError, SchemaError, SpringError
from elastocal.identification import (
    CalibrateResult,
    Contact,
    FitOptions,
    read_contact,
    reproduce_calibration,
    tip_place,
    with_tip_found,
)
from elastocal.records import read_json, write_json
from elastocal.robot import Robot, fixed_joint_of, with_joint_origins
from support.held import Held, held_by_contact, robot

WRONG = np.array([5e-3, -4e-3, 6e-3])
NOISY = Held(noise=5e-6)
KNOWN = Contact(normal=NOISY.normal, lateral=NOISY.lateral, uncertainty=0.1, tip=5e-3)


def described(by: np.ndarray) -> Robot:
    """Return the arm with its tcp beside the true one, weightless as the truth."""
    T = np.eye(4)
    T[:3, 3] = by
    joint = fixed_joint_of(robot().urdf, "tcp")
    made = Robot.from_urdf(with_joint_origins(robot().urdf, {joint: T}), "tcp")
    return replace(made, gravity=(0.0, 0.0, 0.0))


@cache
def found(how: Held = NOISY):
    readings = held_by_contact(how).readings(robot().joint_names)
    return with_tip_found(described(WRONG), readings, FitOptions(contact=KNOWN))


@pytest.mark.slow
def test_the_place_across_the_normal_is_found():
    tip = found()[1].contact.tip_found
    np.testing.assert_allclose(tip.place[:2], -WRONG[:2], atol=1e-3)
    assert tip.beside_gears == tip.place


def test_the_robot_has_its_tcp_where_the_tip_was_found():
    moved, options = found()
    q = np.full(6, 0.3)
    T_old, T_new = described(WRONG).forward(q), moved.forward(q)
    shift = T_old[:3, :3].T @ (T_new - T_old)[:3, 3]
    np.testing.assert_allclose(shift, options.contact.tip_found.place, atol=1e-8)
    np.testing.assert_allclose(T_new[:3, :3], T_old[:3, :3], atol=1e-8)


def test_without_a_width_the_place_is_exact():
    readings = held_by_contact(NOISY).readings(robot().joint_names)
    exact, arm = FitOptions(contact=replace(KNOWN, tip=None)), described(WRONG)
    assert with_tip_found(arm, readings, exact) == (arm, exact)


@cache
def elsewhere(seed: int = 0) -> Dataset:
    data, arm = held_by_contact(NOISY, seed), described(WRONG)
    said = arm.forward(data.reference_joint_position)[:, :3, 3]
    attributes = {**data.attributes, "robot_urdf": arm.urdf}
    return replace(data, attributes=attributes, tcp_position=said)


@cache
def calibrated(seed: int = 0) -> CalibrateResult:
    return ec.calibrate(elsewhere(seed), contact=KNOWN, springs="actuated", draws=40)


def test_calibrate_says_where_the_tip_is_with_an_interval_that_holds_it():
    tip = calibrated().calibration.contact.tip
    assert np.all((np.array(tip.low) <= -WRONG) & (np.array(tip.high) >= -WRONG))
    assert tip.told()[:2] == (True, True)
    assert "The tip lies beside the stated tcp along x:" in str(tip.sentence())


def test_an_axis_along_which_the_readings_say_no_more_than_was_stated_has_no_number():
    low, high = (-1e-3, -1e-3, -5e-3), (1e-3, 1e-3, 1e-2)
    tip = replace(calibrated().calibration.contact.tip, stated=5e-3, low=low, high=high)
    assert tip.told() == (True, True, False)
    assert "along z: not told from the springs" in str(tip.sentence())


def test_the_draws_of_a_prediction_move_the_tip():
    model = calibrated().calibrated
    q, force = np.full((1, 6), 0.3), np.array([[0.0, 100.0, -900.0]])
    for draw in (0, 7):
        # A draw is springs and a tip: what it predicts is what a model with its tcp there does.
        own = replace(model, compliance=model.draws[draw], tip=None)
        T = np.eye(4)
        T[:3, 3] = model.tip[draw]
        wanted = own.with_tool(T).predict(q, force).deflection
        alone = own.predict(q, force).deflection
        by_shift = model.shift_blocks(model.model.at(q), force) @ model.tip[draw]
        assert np.linalg.norm(alone + by_shift - wanted) < 0.05 * np.linalg.norm(alone - wanted)
    exact = replace(model, tip=np.zeros_like(model.tip)).predict(q, force)
    assert not np.allclose(exact.low, model.predict(q, force).low, rtol=1e-3)


def test_a_model_file_keeps_where_the_draws_have_the_tip(tmp_path):
    write_json(tmp_path / "model.json", calibrated())
    read = read_json(tmp_path / "model.json", CalibrateResult)
    np.testing.assert_array_equal(read.tip, calibrated().tip)
    with pytest.raises(SchemaError, match=r"tip \(\d+, 3\) must be \(\d+, 3\): one a draw"):
        replace(calibrated(), tip=calibrated().tip[1:])
    with pytest.raises(SchemaError, match="tip is nan m: it must be finite"):
        replace(calibrated(), tip=np.full_like(calibrated().tip, np.nan))


def test_a_model_file_refuses_ends_of_intervals_that_are_none():
    ends = calibrated().spring_ends
    for rows in (ends[:1], ends[:0], ends[:, :1]):
        with pytest.raises(SchemaError, match=r"spring_ends \(\d+, \d\) must be \(\d+, 2\)"):
            replace(calibrated(), spring_ends=rows)
    with pytest.raises(SchemaError, match="the lower end before the upper one"):
        replace(calibrated(), spring_ends=ends[:, ::-1])
    with pytest.raises(SpringError, match="spring_ends"):
        replace(calibrated(), spring_ends=np.full_like(ends, np.nan))


def test_positions_of_the_described_tcp_are_no_sign_of_another_tool():
    assert np.linalg.norm(WRONG) > 5e-3
    assert not [each for each in calibrated().calibration.warnings if "tcp_position" in each]


def test_two_campaigns_of_one_arm_have_not_moved_where_each_has_found_its_tip():
    found = ec.compare(calibrated(), calibrated(1)).summary
    assert found.moved == ()
    said = [each for each in found.notes if "its tip where it was found beside the springs" in each]
    assert len(said) == 1
    assert not [each for each in found.notes if "another tool" in each]


@pytest.mark.slow
def test_a_report_makes_the_same_fit_again():
    model = calibrated()
    assert reproduce_calibration(model.calibrated, model.calibration, elsewhere()).same


def test_tracked_production_does_not_update_a_model_whose_tip_was_found(tmp_path):
    write_json(tmp_path / "model.json", calibrated())
    with pytest.raises(IdentificationError, match=r"contact\.tip left out\) before --update"):
        ec.calibrate(elsewhere(), update=tmp_path / "model.json")


def test_predict_compensate_and_export_take_such_a_model(tmp_path):
    model, names = calibrated(), robot().joint_names
    q = elsewhere().readings(names).joint_position[:3]
    rows = np.column_stack([q, np.tile([0.0, 100.0, -900.0], (3, 1))])
    heads = [*(f"{each}[rad]" for each in names), *(f"force_{axis}[N]" for axis in "xyz")]
    path = tmp_path / "path.csv"
    np.savetxt(path, rows, "%.17g", ",", header=",".join(heads), comments="")
    wanted = model.calibrated.predict(rows[:, :6], rows[:, 6:])
    np.testing.assert_allclose(ec.predict(model, path).prediction.low, wanted.low, rtol=1e-9)
    ec.compensate(model, path, out=tmp_path / "corrected.csv")
    ec.export(model, out=tmp_path / "c")
    assert (tmp_path / "corrected.csv").exists()
    assert any((tmp_path / "c").iterdir())


def test_another_tool_is_stated_from_the_tip_and_moves_with_it():
    model = calibrated().calibrated
    T = np.eye(4)
    T[:3, :3] = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    np.testing.assert_allclose(model.with_tool(T).tip, model.tip @ T[:3, :3])


def test_a_tracked_pose_is_refused_with_it():
    readings = held_by_contact(Held(tracked=3)).readings(robot().joint_names)
    with pytest.raises(IdentificationError, match=r"leave contact\.tip out"):
        with_tip_found(described(WRONG), readings, FitOptions(contact=KNOWN))


def test_a_contact_file_states_the_width(tmp_path):
    path = tmp_path / "contact.yaml"
    path.write_text('contact: {normal: "50 N/um", tip: "5 mm"}\n')
    assert read_contact(path) == Contact(normal=50e6, tip=5e-3)
    with pytest.raises(IdentificationError, match=r"contact\.tip is 0\.2: it must be above 0"):
        Contact(tip=0.2)


def test_readings_with_moments_are_refused_with_it():
    # About the tcp that is stated: taken as those about the tip, they led to half of its place.
    readings = held_by_contact(NOISY).readings(robot().joint_names)
    R = described(WRONG).forward(readings.joint_position)[:, :3, :3]
    readings = replace(readings, moment=np.cross(R @ -WRONG, readings.force))
    with pytest.raises(IdentificationError, match=r"leave the columns of the moment out, or conta"):
        with_tip_found(described(WRONG), readings, FitOptions(contact=KNOWN))


def test_why_the_tip_is_not_found_beside_gears_is_said(monkeypatch):
    monkeypatch.setattr(tip_place, "bearing_gears", tip_place.gears)
    readings = held_by_contact(NOISY).readings(robot().joint_names)
    free = FitOptions(contact=Contact(lateral=NOISY.lateral, tip=5e-3))
    with pytest.raises(IdentificationError, match=r"contact\.normal is free, and the springs imi"):
        with_tip_found(described(WRONG), readings, free)


@pytest.mark.slow
def test_one_blunder_does_not_move_the_tip():
    displacement = elsewhere().controller_displacement.copy()
    displacement[4, 1, 2] += 3e-3
    found = ec.calibrate(
        replace(elsewhere(), controller_displacement=displacement),
        contact=KNOWN, springs="actuated", draws=40,
    )  # fmt: skip
    without = calibrated().calibration.contact.tip
    # It was found 44 mm away, and predictions were off by an eighth.
    np.testing.assert_allclose(found.calibration.contact.tip.place, without.place, atol=0.5e-3)
    q, force = np.full((1, 6), 0.3), np.array([[0.0, 100.0, -900.0]])
    there, here = (each.calibrated.predict(q, force).deflection for each in (found, calibrated()))
    assert np.linalg.norm(there - here) < 0.005 * np.linalg.norm(here)
