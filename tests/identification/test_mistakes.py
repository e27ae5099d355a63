"""Common mistakes of shop floors are found and named; sound campaigns pass in silence."""

import numpy as np
import pytest

from elastocal.elastic import ElasticModel, bearing
from elastocal.errors import ConventionError
from elastocal.identification import FitOptions, calibrate
from support.by_day import some_by_day
from support.campaigns import Sound, campaign, sounds
from support.further_mistakes import FURTHER
from support.mistake_table import alarms, outcome, rates, tabulate
from support.mistakes import MISTAKES, changed
from support.walk_mistakes import MADE_IN, require_whole

KNOWN = {each.name: each for each in (*MISTAKES, *FURTHER)}
ON_RAIL, SMALL = Sound(poses=15, seed=1), Sound(like="ur20", poses=12, seed=2)
REFUSED = (
    "force_x reversed",
    "force turned by 90 deg about the tool",
    "forces of the row before",
    "tracker frame left-handed",
    "tracker frame called base, turned by 40 deg",
    "controller displacement reversed",
    "first joint reversed",
    "joints of the row before",
    "zero of the third joint off by 90 deg",
    "zero of the force taken in contact",
    "sensor mounted upside down, turned by 90 deg",
    "deflection in the marker's column",
    "marker counted from the load case before",
    "third joint half its size",
    "zero of the second joint off by 10 deg",
    "zero of the third joint off, controller displacement computed",
    "tcp 100 mm off along z",
    "all of another base, upside down",
)
WARNED = (
    "force in kgf",
    "force_x dead",
    "weight of the tool left in",
    "marker_z dead",
    "drift of 1 mm",
    "station bumped half way, 1 mm",
    "one pose's rows all the same",
    "forces read before they settled",
    "station moved in the middle third",
    "forces in lbf from half way on",
)


@pytest.mark.parametrize("name", some_by_day(REFUSED))
def test_a_certain_mistake_is_refused_by_name(name):
    found = outcome(campaign(ON_RAIL), KNOWN[name], with_harm=False)
    assert found.refused, found.said
    assert found.named, found.said


@pytest.mark.parametrize("name", some_by_day(WARNED))
def test_a_likely_mistake_is_warned_of_by_name(name):
    found = outcome(campaign(ON_RAIL), KNOWN[name], with_harm=False)
    assert not found.refused, found.said
    assert found.named, found.said


@pytest.mark.parametrize("sound", [ON_RAIL, SMALL, Sound(poses=8, seed=3, conditioned=True)])
def test_a_sound_campaign_passes_in_silence(sound):
    assert alarms(campaign(sound)) == ()


def test_conventions_that_are_trusted_turn_a_refusal_into_a_warning():
    bad = KNOWN["first joint reversed"].make(changed(campaign(ON_RAIL), tcp_position=None))
    model, rng = ElasticModel(bad.robot, bearing(bad.robot)), np.random.default_rng(0)
    with pytest.raises(ConventionError, match="joint_a1 turns the other way round"):
        calibrate(model, bad.readings, rng, FitOptions(draws=40), marker_offset=bad.marker)
    options = FitOptions(draws=40, trust_conventions=True)
    found = calibrate(model, bad.readings, rng, options, marker_offset=bad.marker)
    assert any("fitted in spite of this: joint_a1" in text for text in found.warnings)


@pytest.mark.slow
def test_200_sound_campaigns_of_all_presets_raise_two_alarms_at_most():
    raised = {sound: alarms(campaign(sound)) for sound in sounds(200)}
    assert sum(map(bool, raised.values())) <= 2, {k: v for k, v in raised.items() if v}


@pytest.mark.slow
def test_of_the_harmful_mistakes_nine_of_ten_are_found_and_named():
    made = [(sound, mistake) for sound in MADE_IN for mistake in (*MISTAKES, *FURTHER)]
    outcomes = [outcome(campaign(sound), mistake) for sound, mistake in made]
    found, named = rates(tabulate(outcomes))
    assert found >= 0.9
    assert named >= 0.9


def test_the_documentation_shows_every_mistake_in_campaigns():
    require_whole("calibrate", found=0.9, named=0.9, most_alarms=0.01)


def test_a_tool_weight_is_named_once():
    made = KNOWN["weight of the tool left in"].make(campaign(ON_RAIL))
    model, rng = ElasticModel(made.robot, bearing(made.robot)), np.random.default_rng(0)
    found = calibrate(
        model, made.readings, rng, FitOptions(draws=40), marker_offset=made.marker
    ).warnings
    assert sum("seem to contain a constant" in text for text in found) == 1
