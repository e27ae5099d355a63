"""The light: what makes it green, yellow or red, and what is said beside it."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal.findings import Grade, Kind
from elastocal.identification import UnseenErrors
from elastocal.identification.recertification import Estimate
from elastocal.report.document.page import verdict_html
from elastocal.verdict import Light
from elastocal.verdict.evidence import AcceptanceLimits
from elastocal.verdict.judgement import advise, judge

NOTE = Kind("test.note", "{text}", grade=Grade.NOTE)
ADVISED = Kind("test.advised", "{text}", advice="One.", grade=Grade.NOTE)
OPEN = Kind("test.open", "{text}", advice="Fix it.")
BROKEN = Kind("test.broken", "{text}", grade=Grade.REFUSAL)


def errors(worst, low, high, count=20):
    """Errors at unseen poses with a given largest one and interval, in mm."""
    error = np.full(count, 0.05e-3)
    error[-1] = 1e-3 * worst
    p95 = Estimate(0.5e-3 * (low + high), 1e-3 * low, 1e-3 * high)
    mean = Estimate(float(error.mean()), 0.04e-3, 0.08e-3)
    return UnseenErrors(error, np.arange(count), ("normal",) * count, count, mean, p95)


def judged(parts, worst, low, high, tolerance=0.3e-3, findings=()):
    again = replace(parts.reproduction, unseen=errors(worst, low, high))
    limits = AcceptanceLimits(tolerance, None, "of the test")
    return judge(replace(parts, reproduction=again, limits=limits), findings)


def test_green_when_interval_and_every_reading_are_within(parts):
    verdict = judged(parts, worst=0.29, low=0.1, high=0.3)
    assert verdict.light is Light.GREEN
    assert verdict.word == "Within the tolerance"
    assert verdict.reasons == ()
    assert "err by at most 0.300 mm" in verdict.meaning
    assert "releases no real robot" in verdict.meaning


def test_yellow_when_the_interval_reaches_beyond(parts):
    verdict = judged(parts, worst=0.29, low=0.1, high=0.31)
    assert (verdict.light, verdict.word) == (Light.YELLOW, "Not proved")
    assert "0.100 mm to 0.310 mm" in verdict.reasons[0]


def test_yellow_when_a_single_reading_is_beyond(parts):
    verdict = judged(parts, worst=0.4, low=0.1, high=0.2)
    assert verdict.light is Light.YELLOW
    (reason,) = verdict.reasons
    assert reason == (
        "1 of 20 readings was predicted wrong by more than 0.300 mm: by 0.400 mm, at pose 19, load"
        " case normal"
    )
    assert verdict.meaning == (
        "1 of 20 readings predicted wrong by more than 0.300 mm: not proved that the predictions"
        " keep within it. A simulation releases nothing; a real cell with this result"
        " would not be released for production."
    )


def test_red_when_the_whole_interval_is_beyond(parts):
    verdict = judged(parts, worst=0.9, low=0.31, high=0.5)
    assert (verdict.light, verdict.word) == (Light.RED, "Beyond the tolerance")
    assert "the whole interval" in verdict.reasons[0]


def test_what_is_not_a_number_is_never_within(parts):
    assert judged(parts, worst=np.nan, low=np.nan, high=np.nan).light is Light.RED
    assert judged(parts, worst=np.nan, low=0.1, high=0.2).light is Light.YELLOW


def test_a_finding_that_holds_back_makes_it_yellow_and_is_told(parts):
    findings = (OPEN(text="the station moved"), NOTE(text="a note"))
    verdict = judged(parts, 0.2, 0.1, 0.2, findings=findings)
    assert (verdict.light, verdict.word) == (Light.YELLOW, "Within, with open points")
    assert verdict.reasons == ("the station moved",)
    assert verdict.notes == ("a note",)
    assert verdict.advice == ("Fix it.",)


def test_files_that_were_changed_are_told_before_every_figure(parts):
    findings = (OPEN(text="a warning"), BROKEN(text="model.json was changed"))
    verdict = judged(parts, worst=0.4, low=0.1, high=0.2, findings=findings)
    assert verdict.reasons[0] == "model.json was changed"
    assert "cannot be relied on. A simulation releases nothing" in verdict.meaning
    again = replace(parts.reproduction, same=False)
    verdict = judge(replace(parts, reproduction=again), findings)
    assert verdict.word == "Not to be relied on"


def test_a_real_cell_that_is_not_proved_is_not_to_be_released(parts):
    again = replace(parts.reproduction, unseen=errors(worst=0.29, low=0.1, high=0.31))
    real = replace(parts, reproduction=again, cell=None)
    assert judge(real, ()).meaning == (
        "Not proved that the predictions keep within 0.300 mm. Do not release for production."
    )


def test_errors_beyond_the_tolerance_are_not_lost_behind_files_that_were_changed(parts):
    findings = [BROKEN(text=f"file {number} was changed") for number in range(4)]
    verdict = judged(parts, worst=0.9, low=0.31, high=0.5, findings=findings)
    assert verdict.reasons[0] == "file 0 was changed"
    assert "the whole interval is beyond" in verdict.reasons[1]
    assert len(verdict.reasons) == 6


def test_the_largest_errors_at_one_pose_are_told_together():
    many = errors(0.4, 0.1, 0.2)
    assert many.at_one_pose() is None
    several = replace(many, pose=np.repeat(np.arange(5), 4), error=np.linspace(1e-4, 2.9e-4, 20))
    assert several.at_one_pose().sentence == (
        "The 4 largest errors are all at pose 4; at the other poses none exceeds 0.250 mm."
    )


def test_a_note_alone_leaves_it_green(parts):
    assert judged(parts, 0.2, 0.1, 0.2, findings=(NOTE(text="n"),)).light is Light.GREEN


def test_red_stays_red_whatever_is_missing(parts):
    verdict = judged(parts, 0.9, 0.4, 0.5, findings=(OPEN(text="x"),))
    assert verdict.light is Light.RED


def test_without_a_tolerance_there_is_no_light_but_a_sentence(parts):
    verdict = judged(parts, 0.2, 0.1, 0.2, tolerance=None, findings=(OPEN(text="x"),))
    assert verdict.light is None
    assert "No tolerance was given" in verdict.sentence
    assert verdict.reasons == ("x",)
    html = verdict_html(parts, verdict)
    assert '<p class="light none">' in html
    assert "What has to be known" in html


def test_without_a_model_there_is_nothing_to_judge(parts):
    verdict = judge(replace(parts, calibrated=None, reproduction=None), ())
    assert verdict.light is None
    assert "no calibrated model" in verdict.reasons[0]


def test_errors_that_could_not_be_made_again_give_no_green(parts):
    for again in (None, replace(parts.reproduction, same=False)):
        verdict = judge(replace(parts, reproduction=again), ())
        assert verdict.light is Light.YELLOW
        assert "no interval" in verdict.reasons[0]
        assert "could not be reproduced here: do not use them" in verdict.sentence


@pytest.mark.parametrize("light", list(Light))
def test_colour_is_never_alone(parts, light):
    verdict = replace(judged(parts, 0.2, 0.1, 0.2), light=light)
    html = verdict_html(parts, verdict)
    assert f"{light.value} light" in html
    assert verdict.word in html
    html = html.partition("</svg>")[0]
    shapes = {Light.GREEN: "<circle", Light.YELLOW: "M24 3L46", Light.RED: "M15 3h18"}
    assert [shape in html for shape in shapes.values()] == [each is light for each in Light]


def test_a_simulated_cell_is_told_in_the_verdict(parts):
    assert "no real robot was measured" in verdict_html(parts, judge(parts, ()))


def test_advice_weighs_the_tracker_against_the_errors(parts):
    def told(scatter):
        registration = replace(parts.summary.registration, scatter=scatter)
        noise = replace(parts.summary.noise, marker_sigma_median=None)
        summary = replace(parts.summary, registration=registration, noise=noise)
        return " ".join(advise(replace(parts, summary=summary)))

    mean = parts.reproduction.unseen.mean.value
    assert "Average longer" in told(0.5 * mean)
    assert "quieter tracker would not help" in told(0.1 * mean)
    assert "its readings scatter" not in told(None)


def test_scatter_of_the_stops_is_not_laid_at_the_trackers_door(parts):
    mean = parts.reproduction.unseen.mean.value
    registration = replace(parts.summary.registration, scatter=0.5 * mean)
    noise = replace(parts.summary.noise, marker_sigma_median=0.05 * mean)
    summary = replace(parts.summary, registration=registration, noise=noise)
    text = " ".join(advise(replace(parts, summary=summary)))
    assert "Average longer" not in text
    assert "Where the arm stops scatters by" in text


def test_advice_names_the_pose_of_the_largest_error_when_it_stands_out(parts):
    again = replace(parts.reproduction, unseen=errors(worst=0.5, low=0.1, high=0.2))
    found = " ".join(advise(replace(parts, reproduction=again)))
    assert "Look at pose 19, load case normal first" in found
    assert "0.500 mm" in found


def test_advice_stands_behind_that_of_the_findings_and_holds_nothing_back(parts):
    again = replace(parts.reproduction, unseen=errors(0.2, 0.1, 0.2))
    findings = (ADVISED(text="a note"),)
    verdict = judge(replace(parts, reproduction=again), findings, ("Two.", "One."))
    assert verdict.light is Light.GREEN
    assert verdict.advice == ("One.", "Two.")


@pytest.mark.parametrize("tolerance", [10e-3, None])
def test_red_whatever_the_tolerance_when_the_model_leaves_more_than_half(parts, tolerance):
    figures = parts.figures
    held_out = replace(figures.held_out, mean=0.6 * figures.deflection.mean)
    bad = replace(parts.calibrated, figures=replace(figures, held_out=held_out))
    verdict = judged(
        replace(parts, calibrated=bad), worst=0.29, low=0.1, high=0.2, tolerance=tolerance
    )
    assert (verdict.light, verdict.word) == (Light.RED, "Not fit for use")
    assert "60% of the deflection unexplained" in verdict.reasons[0]
    assert "less than half" in verdict.meaning
