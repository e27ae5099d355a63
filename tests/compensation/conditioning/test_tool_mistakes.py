"""Mistakes in tables of postures are found and named; sound tables pass in silence."""

import pytest

from support.by_day import some_by_day
from support.mistake_table import rates, tabulate
from support.tool_mistakes import tool_alarms
from support.walk_mistakes import WALKS, require_same, require_whole

WALK = WALKS["tool"]
REFUSED = (
    "force_z dead",
    "force_x reversed",
    "force x, y exchanged",
    "moment_x reversed",
    "sensor turned by 10 deg",
    "zero pressed half way",
    "half the weight from half way on",
    "base tilted by 10 deg",
    "orientations of the row before",
    "angles about x, y, z",
)
WARNED = ("forces in kgf", "contact in every third posture", "bias drifts by 60 N")


@pytest.mark.parametrize("name", some_by_day([*REFUSED, *WARNED]))
def test_a_mistake_in_postures_is_named_as_the_documentation_shows(name):
    found = require_same("tool", 1, name)
    assert found.named, found.said
    assert found.refused is (name in REFUSED)


@pytest.mark.slow
@pytest.mark.parametrize("sound", some_by_day(WALK.sound[3:6]), ids=lambda each: each.title)
def test_a_sound_table_of_postures_passes_in_silence(sound):
    assert tool_alarms(sound) == ()


def test_the_documentation_shows_every_mistake_in_postures():
    require_whole("tool", found=1.0, named=0.9, most_alarms=0.01)


@pytest.mark.slow
def test_every_harmful_mistake_in_postures_is_found_and_nine_of_ten_are_named():
    made = [(sound, mistake) for sound in WALK.made_in for mistake in WALK.mistakes]
    found, named = rates(tabulate(WALK.outcome(*each) for each in made))
    assert found == 1.0
    assert named >= 0.9
    assert sum(bool(WALK.alarms(sound)) for sound in WALK.sound) <= 1
