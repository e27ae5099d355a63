"""Secondary encoders: rows of the joints beside those of the tracker."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import elastocal as ec
from elastocal.codec import CodecOptions, cross_validate
from elastocal.dataset import Dataset, read, write
from elastocal.elastic import ElasticModel, bearing
from elastocal.identification import FitOptions, build, calibrate, leave_poses_out, solve
from elastocal.sim.arm import SHOP_FLOOR
from elastocal.sim.arm.elastic_arm import AXIAL_STIFFNESS, GRAVITY, bearing_truth
from support.cells import Cell, linkage, robot as arm
from support.cli import elastocal

AXIAL = 1.0 / np.array(AXIAL_STIFFNESS)


@cache
def data(encoder: float | None = 2e-6, poses: int = 12) -> Dataset:
    """Return a campaign on another arm than the estimator's: rest of least energy, gravity."""
    truth = bearing_truth(linkage(), gravity=GRAVITY)
    return Cell(truth, poses=poses, noise=replace(SHOP_FLOOR, encoder=encoder)).measure()


def axial(model: ElasticModel) -> list[int]:
    return [n for n, name in enumerate(model.parameter_names) if name.endswith(".axial")]


def fitted(dataset: Dataset, options: FitOptions | None = None):
    model = ElasticModel(arm(), bearing(arm()))
    problem = build(model, dataset.readings(arm().joint_names), options)
    return model, problem, solve(problem).compliance


def test_gears_are_found_where_the_tracker_sees_sums_alone():
    model, _, found = fitted(data())
    np.testing.assert_allclose(found[axial(model)], AXIAL, rtol=0.03)
    _, _, blind = fitted(data(), FitOptions(encoders=False))
    assert np.abs(blind[axial(model)] / AXIAL - 1.0).max() > 0.1


def test_without_links_at_the_reference_differences_between_loads_find_them():
    loaded = replace(data(), reference_link_joint_position=None)
    model, problem, found = fitted(loaded)
    # The torque about the last joint hardly differs between the loads.
    np.testing.assert_allclose(found[axial(model)][:5], AXIAL[:5], rtol=0.03)
    assert not problem.encoders.seen.any()


def test_a_zero_of_the_encoders_at_each_pose_changes_nothing():
    offset = np.random.default_rng(1).uniform(-1e-3, 1e-3, (len(data().poses), 6))
    moved = replace(
        data(),
        link_joint_position=data().link_joint_position + offset[:, None],
        reference_link_joint_position=data().reference_link_joint_position + offset,
    )
    np.testing.assert_allclose(fitted(moved)[2], fitted(data())[2], rtol=1e-6, atol=1e-14)
    without = [replace(each, reference_link_joint_position=None) for each in (moved, data())]
    first, second = (fitted(each)[2] for each in without)
    np.testing.assert_allclose(first, second, rtol=1e-6, atol=1e-14)


def test_encoders_at_some_joints_leave_the_others_to_the_tracker():
    link, reference = (
        np.array(getattr(data(), name))
        for name in ("link_joint_position", "reference_link_joint_position")
    )
    link[..., 3:], reference[..., 3:] = np.nan, np.nan
    some = replace(data(), link_joint_position=link, reference_link_joint_position=reference)
    model, problem, found = fitted(some)
    assert problem.encoders.joints == arm().joint_names[:3]
    np.testing.assert_allclose(found[axial(model)][:3], AXIAL[:3], rtol=0.03)


def test_the_tracker_has_no_share_in_what_encoders_see():
    """Their columns leave the tracker's rows but for what the way to the reference makes."""
    model, problem, _ = fitted(data())
    rows = problem.weighted()
    whole = np.linalg.norm(problem.O[:, :, axial(model)], axis=(0, 1))
    left = np.linalg.norm(rows[:, :3, axial(model)], axis=(0, 1))
    assert np.all(left < 0.01 * whole)
    assert rows.shape[1] == 3 + 6


def test_joint_rows_times_the_jacobian_are_the_columns_of_the_gears():
    model = ElasticModel(arm(), bearing(arm()))
    q, force = data().joint_position[0, 0], np.array([100.0, -50.0, -900.0])
    O, A = model.observation_blocks(q, force), model.joint_blocks(q, force)  # noqa: E741 - paper
    moved = arm().jacobian(q).translation @ A
    np.testing.assert_allclose(moved[:, axial(model)], O[:, axial(model)], atol=1e-12)
    others = np.setdiff1d(np.arange(O.shape[1]), axial(model))
    assert not A[:, others].any()


def test_some_readings_and_columns_keep_their_encoders():
    _, problem, _ = fitted(data())
    some = problem.take(np.arange(10)).with_columns(np.array([0, 3, 6]))
    np.testing.assert_array_equal(
        some.weighted(), problem.weighted()[:10][:, :, [0, 3, 6, problem.columns]]
    )
    heavier = problem.reweighted(np.full(len(problem), 4.0))
    np.testing.assert_allclose(heavier.weighted(), 2.0 * problem.weighted())


def test_free_frames_are_estimated_beside_encoders():
    model, problem, found = fitted(data(), FitOptions(free_frame="load_case"))
    np.testing.assert_allclose(found[axial(model)], AXIAL, rtol=0.03)
    assert problem.of_springs().weighted().shape[1:] == (9, problem.springs.stop + 1)


def test_a_calibration_states_its_errors_with_and_without_encoders():
    model = ElasticModel(arm(), bearing(arm()))
    readings = data().readings(arm().joint_names)
    found = calibrate(model, readings, np.random.default_rng(0), FitOptions(draws=40))
    problem = build(model, readings)
    each = leave_poses_out(problem)
    seen, folds = problem.encoders.seen, each.compliance[each.fold]
    error = np.einsum("rin,rn->ri", problem.O - seen[..., :-1], folds)
    error -= problem.d - seen[..., -1]
    assert found.encoders.held_out == pytest.approx(np.linalg.norm(error, axis=1).mean(), rel=1e-9)
    # Noise of four readings of an encoder, of the force, and no more.
    assert all(2.5e-6 < left < 8e-6 for left in found.encoders.unexplained)


def test_noise_of_the_encoders_shows_in_what_is_left():
    loud = fitted(data(2e-5))
    left = loud[1].encoders.residuals(loud[2])
    assert np.sqrt(np.mean(np.square(left))) == pytest.approx(2e-5 * np.sqrt(2.0), rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("joint", "factor", "message"),
    [(1, -1.0, "see what no load on their gears makes"), (2, 0.0, "see nothing of their gears")],
)
def test_an_encoder_that_is_turned_or_repeats_its_motor_is_named(joint, factor, message):
    own = np.where(np.arange(6) == joint, factor, 1.0)
    q, q_0 = data().joint_position, data().reference_joint_position
    wrong = replace(
        data(),
        link_joint_position=q + own * (data().link_joint_position - q),
        reference_link_joint_position=q_0 + own * (data().reference_link_joint_position - q_0),
    )
    model, readings = ElasticModel(arm(), bearing(arm())), wrong.readings(arm().joint_names)
    found = calibrate(model, readings, np.random.default_rng(0), FitOptions(draws=40))
    (warning,) = [str(each) for each in found.warnings if "encoders" in str(each)]
    assert message in warning
    assert arm().joint_names[joint] in warning


def test_sound_encoders_are_not_warned_of():
    model, readings = ElasticModel(arm(), bearing(arm())), data().readings(arm().joint_names)
    found = calibrate(model, readings, np.random.default_rng(0), FitOptions(draws=40))
    assert not [each for each in found.warnings if "encoders" in str(each)]


@pytest.mark.slow
def test_the_command_uses_and_leaves_them(tmp_path):
    path = tmp_path / "data.nc"
    write(data(), path)
    out = tmp_path / "model.json"
    said = elastocal("calibrate", path, "--springs", "bearing", "--out", out, "--json")
    found = json.loads(said.out)["encoders"]
    assert found["joints"] == list(arm().joint_names)
    said = elastocal("calibrate", path, "--springs", "bearing", "--out", out, "--force")
    assert "Secondary encoders" in said.err
    told = ec.calibrate(path, springs="bearing", ignore_encoders=True)
    write(replace(data(), link_joint_position=None, reference_link_joint_position=None), path)
    assert read(path).link_joint_position is None
    plain = ec.calibrate(path, springs="bearing")
    np.testing.assert_array_equal(told.calibrated.compliance, plain.calibrated.compliance)


@pytest.mark.slow
def test_a_codec_trains_with_them():
    readings = data(2e-6, 9).readings(arm().joint_names)
    made = cross_validate(arm(), readings, options=CodecOptions(splits=3), jobs=1)
    blind = replace(readings, link_joint_position=None, reference_link_joint_position=None)
    other = cross_validate(arm(), blind, options=CodecOptions(splits=3), jobs=1)
    assert not np.array_equal(made.compliance[0], other.compliance[0])
