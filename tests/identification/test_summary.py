import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from elastocal.identification import (
    CalibrateResult,
    Calibration,
    DeflectionSummary,
    FitOptions,
    FitSettings,
    calibrate,
    spring_summaries,
    summary,
)
from elastocal.identification.show import show_calibration
from elastocal.records import to_data
from elastocal.sim.arm import (
    Blunder,
)
from support.cells import Cell, linear_truth
from support.problems import elastic

BLUNDERS = (Blunder(3, "west", (0.0, 0.5, 0.0)), Blunder(9, "north", (2e-4, 3e-4, 0.0)))


@cache
def calibration(springs="bearing", keep=False) -> Calibration:
    readings = Cell(linear_truth(), blunders=BLUNDERS).readings()
    options = FitOptions(set_blunders_aside=not keep)
    return calibrate(elastic(springs), readings, np.random.default_rng(0), options)


@pytest.mark.slow
def test_it_is_json_without_nan():
    text = json.dumps(to_data(summary(calibration())), allow_nan=False)
    assert json.loads(text)["schema"] == "elastocal.calibration/2"


def test_the_residuals_are_those_of_the_readings_in_the_fit():
    figures, made = summary(calibration()), calibration()
    norms = np.linalg.norm(made.residual, axis=1)[made.used]
    assert figures.readings == len(norms) == 154
    assert figures.residual.mean == pytest.approx(norms.mean())
    assert figures.residual.max == pytest.approx(norms.max())
    assert figures.residual.p95 == pytest.approx(np.percentile(norms, 95))
    rms = np.sqrt(np.mean(made.residual[made.used] ** 2, axis=0))
    assert figures.residual.rms_axis == pytest.approx(rms.tolist())


def test_the_residual_is_prediction_minus_measurement():
    made = calibration()
    found = made.calibrated.predict(made.readings.joint_position, made.readings.force).deflection
    np.testing.assert_allclose(made.residual, found - made.readings.deflection, atol=1e-12)


def test_deflections_are_those_measured():
    figures, made = summary(calibration()), calibration()
    norms = np.linalg.norm(made.readings.deflection, axis=1)[made.used]
    assert figures.deflection == DeflectionSummary(norms.mean(), norms.max())


def test_every_spring_has_its_interval_and_says_whether_it_is_observable():
    figures = summary(calibration())
    assert [row.name for row in figures.springs] == list(elastic().spring_names)
    assert all(row.low <= row.high for row in figures.springs)
    assert {row.unit for row in figures.springs} == {"rad/(N*m)"}
    groups = (*figures.unobservable, *figures.hidden)
    hidden = {term.spring for group in groups for term in group}
    weak = {row.name for row in figures.springs if row.too_weak}
    assert {row.name for row in figures.springs if not row.observable} == hidden | weak
    assert (figures.rank, figures.springs_total, len(figures.unobservable)) == (15, 18, 3)


def test_suspicious_readings_come_worst_first_and_say_whether_they_were_set_aside():
    listed = summary(calibration()).suspicious
    where = [(row.pose, row.load_case, row.set_aside) for row in listed]
    assert where[:2] == [(3, "west", True), (9, "north", False)]
    scores = [row.score for row in listed]
    assert scores == sorted(scores, reverse=True)


def test_the_reading_to_leave_out_is_one_that_is_still_in_the_fit():
    figures = summary(calibration())
    said = " ".join(str(block) for block in show_calibration(figures))
    assert "--exclude 9:north" in said
    aside = replace(figures, suspicious=figures.suspicious[:1])
    assert "--exclude" not in " ".join(str(block) for block in show_calibration(aside))


@pytest.mark.slow
def test_blunders_that_are_kept_are_named_but_not_set_aside():
    figures = summary(calibration(keep=True))
    assert figures.readings == 155
    assert not figures.suspicious[0].set_aside
    assert figures.residual.mean > 5.0 * summary(calibration()).residual.mean


def test_accuracy_is_stated_with_its_split_and_only_of_poses_left_out():
    figures = summary(calibration())
    held_out = figures.held_out
    assert (held_out.split, held_out.folds, held_out.readings) == (
        "leave-poses-out",
        31,
        154,
    )
    assert held_out.mean > figures.residual.mean


@pytest.mark.slow
def test_the_same_seed_gives_the_same_figures():
    made = calibrate(elastic(), calibration().readings, np.random.default_rng(0))
    assert summary(made) == summary(calibration())
    other = calibrate(elastic(), calibration().readings, np.random.default_rng(1))
    assert summary(other).springs != summary(made).springs
    assert summary(other).residual == summary(made).residual


def test_a_spring_is_at_a_bound_of_the_fit_only():
    made = calibration().calibrated
    zero = np.where(np.arange(len(made.compliance)) == 0, 0.0, 1e-7)
    rows = spring_summaries(replace(made, compliance=zero))
    assert [row.at_bound for row in rows] == [True] + 17 * [False]
    free = spring_summaries(replace(made, compliance=-zero), FitSettings(bounds="-inf,inf"))
    assert not any(row.at_bound for row in free)
    capped = spring_summaries(replace(made, compliance=zero), FitSettings(bounds="-1,1e-7"))
    assert [row.at_bound for row in capped] == [False] + 17 * [True]


def test_the_result_names_springs_and_loss():
    settings = FitSettings(springs="bearing", loss="huber")
    made = calibration()
    text = repr(CalibrateResult.of(made.calibrated, summary(made, settings)))
    assert "fit: springs bearing, loss huber" in text
