"""Common mistakes of shop floors are found and named; sound campaigns pass in silence."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from elastocal.elastic import ElasticModel, bearing
from elastocal.errors import ConventionError
from elastocal.findings import Grade
from elastocal.identification import FitOptions, calibrate
from elastocal.identification.mistakes import find_mistakes
from elastocal.identification.mistakes.plausibility import find_implausible
from elastocal.identification.mistakes.undoing import find_undone
from support.by_day import some_by_day
from support.campaigns import Sound, campaign, sounds
from support.further_mistakes import FURTHER
from support.mistake_table import alarms, outcome, rates, tabulate
from support.mistakes import MISTAKES, changed
from support.outside_mistakes import OUTSIDE
from support.walk_mistakes import MADE_IN, MADE_OUTSIDE, require_whole

KNOWN = {each.name: each for each in (*MISTAKES, *FURTHER, *OUTSIDE)}
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
    "joints of two poses exchanged",
    "joints and references of two poses exchanged",
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
    "sensor turned by 90 deg from half way on",
)


@pytest.mark.slow
def test_what_import_suspected_is_said_in_place_of_another_name():
    """Exchanged axes look to a fit like an axis reversed, or two load cases exchanged."""
    made = campaign(SMALL)
    readings, offset = made.readings, made.marker
    model = ElasticModel(made.robot, bearing(made.robot))
    wrong = replace(readings, force=readings.force @ np.diag([1.0, 1.0, -1.0]))
    with pytest.raises(ConventionError, match="looks reversed"):
        find_mistakes(model, wrong, FitOptions(), offset)
    doubts = ("force_x and force_y are exchanged", "another one")
    with pytest.raises(ConventionError) as refused:
        find_mistakes(model, replace(wrong, doubts=doubts), FitOptions(), offset)
    assert str(refused.value).startswith("force_x and force_y are exchanged; another one (`import`")
    sound = find_mistakes(model, readings, FitOptions(), offset)
    suspected = find_mistakes(model, replace(readings, doubts=doubts), FitOptions(), offset)
    assert [*map(str, suspected)] == [f"{each} (`import` said so of the logs)" for each in doubts]
    assert not sound


@pytest.mark.parametrize("name", some_by_day(REFUSED))
def test_a_certain_mistake_is_refused_by_name(name):
    found = outcome(campaign(ON_RAIL), KNOWN[name], with_harm=False)
    assert found.refused, found.said
    assert found.named, found.said


@pytest.mark.parametrize("name", [*some_by_day(WARNED, every=9), "force in counts of 1/16 N"])
def test_a_likely_mistake_is_warned_of_by_name(name):
    found = outcome(campaign(ON_RAIL), KNOWN[name], with_harm=False)
    assert not found.refused, found.said
    assert found.named, found.said


@pytest.mark.parametrize(
    "sound", some_by_day([ON_RAIL, SMALL, Sound(poses=8, seed=3, conditioned=True)])
)
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


def seen_at_once(name):
    """Return what readings of a campaign with a mistake show without a fit."""
    bad = KNOWN[name].make(campaign(ON_RAIL))
    return find_implausible(bad.robot, bad.readings, bad.marker)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("forces clipped at 80 % of the largest", "the force stops at"),
        ("force axes of tcp clipped at 80 %", "force_z in the tcp frame stops at"),
        ("force axes of base clipped at 80 %", "force_z in the base frame stops at"),
        ("dead band of 20 %", "force_x in the tcp frame is exactly zero in 75 of 105 readings"),
        ("joints of two poses exchanged", "the joints of poses 4 and 12 look exchanged"),
        ("joints and references of two poses exchanged", "poses 4 and 12 look exchanged"),
        (
            "second joint 2 deg off under load from the third pose on",
            "joint_a2 reads 2 deg more under load than at the reference",
        ),
    ],
)
def test_what_readings_show_by_themselves_is_named_with_what_to_do(name, said):
    (found,) = seen_at_once(name)
    assert said in str(found)


def test_joints_of_single_rows_that_stand_elsewhere_are_named_by_pose_and_load_case():
    made = campaign(ON_RAIL)
    q = made.readings.joint_position.copy()
    q[[8, 17]] = q[[17, 8]]
    (found,) = find_implausible(made.robot, changed(made, joint_position=q).readings, made.marker)
    a, b = (f"pose {made.readings.pose[row]} ({made.readings.load_case[row]})" for row in (8, 17))
    assert f"joints look like those of other rows: at {a} those of {b}" in str(found)
    assert found.grade is Grade.REFUSAL


def test_a_zero_that_is_off_at_the_last_poses_alone_is_named_with_them():
    made = campaign(ON_RAIL)
    off = np.radians(2.0) * (np.arange(7) == 2) * (made.readings.pose >= 11)[:, None]
    moved = {
        name: getattr(made.readings, name) + off
        for name in ("joint_position", "reference_joint_position")
    }
    (found,) = find_implausible(made.robot, changed(made, **moved).readings, made.marker)
    assert "at poses 11 to 14 the zero of joint_a2 is" in str(found)


def test_readings_that_contradict_for_no_known_reason_are_named_by_their_poses():
    made = campaign(ON_RAIL)
    there = np.isin(made.readings.pose, (2, 3, 6))[:, None]
    moved = made.readings.controller_displacement
    bad = changed(made, controller_displacement=np.where(there, moved[:, ::-1] * [1, -2, 1], moved))
    (found,) = find_implausible(bad.robot, bad.readings, bad.marker)
    assert str(found).startswith("at poses 2, 3, 6 joints and controller displacement contradict")


def test_weights_and_forces_that_were_asked_for_are_not_clipped():
    made = campaign(ON_RAIL)
    of_case = np.unique(made.readings.load_case, return_inverse=True)[1]
    hung = np.array([0.0, 0.0, -1.0]) * (200.0 + 100.0 * np.minimum(of_case, 3))[:, None]
    R = made.robot.forward(made.readings.joint_position)[:, :3, :3]
    for force in (hung, np.einsum("rij,rj->ri", R, hung)):
        found = find_implausible(made.robot, changed(made, force=force).readings, made.marker)
        assert not any("stops at" in str(each) for each in found)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sound", "name", "said"),
    [
        (
            ON_RAIL,
            "force_x reversed from half way on",
            "from pose 8 on force_x in the tcp frame looks reversed",
        ),
        (
            Sound(seed=0),
            "drift of the force zero by 30 % of base",
            "N in the base frame over the campaign",
        ),
    ],
)
def test_forces_that_are_wrong_for_a_part_or_drift_are_named(sound, name, said):
    made = KNOWN[name].make(campaign(sound))
    (found,) = find_undone(made.robot, made.readings, made.marker)
    assert said in str(found)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "said"),
    some_by_day(
        (
            ("forces written there and back", "written backwards at every second pose"),
            ("markers with poses sorted as text", "displacements are sorted by pose as text"),
            ("a row of the forces lost half way", "from pose 7 on forces are those of the row"),
            ("a row of the markers lost half way", "from pose 8 on marker displacements are"),
            ("forces 30 % of the next load case", "forces run ahead: they seem to hold 30%"),
            ("cross-talk of 25 % from force_z", "cross-talk, 25% in force_x and -28% in force_y"),
            ("sensor warms up, 40 %", "at the begin of the campaign: let the sensor warm up"),
            ("sensor compressed by 35 %", "the force sensor's gain seems to fall with its load"),
            ("forces of every fourth pose reversed", "at poses 0, 4, 8, 12 the force (or the"),
            ("a file of markers in inches", "poses 8 to 10 marker displacements are in inches"),
        )
    ),
)
def test_mistakes_from_outside_are_named(name, said):
    made = KNOWN[name].make(campaign(ON_RAIL))
    (found,) = find_undone(made.robot, made.readings, made.marker)
    assert said in str(found)


@pytest.mark.parametrize(("turn", "is_named"), [(1.0, False), (5.0, True)])
def test_a_frame_of_the_tracker_is_turned_by_degrees_not_by_an_arm_that_is_off(turn, is_named):
    made = campaign(SMALL)
    exact, model = made.readings, ElasticModel(made.robot, bearing(made.robot))
    bent = model.observation_blocks(exact.joint_position, exact.force, None, made.marker)
    seen = exact.controller_displacement + bent @ np.full(bent.shape[2], 1e-6)
    turned = Rotation.from_euler("z", turn, degrees=True).apply(seen)
    found = find_undone(made.robot, replace(exact, marker_displacement=turned), made.marker)
    assert any("look turned by" in str(each) for each in found) is is_named


@pytest.mark.slow
def test_a_sensor_that_is_tilted_is_named_with_its_tilt():
    """With 15 poses another cause may explain as much."""
    sound = Sound(like="machining", poses=31, seed=1)
    made = KNOWN["sensor tilted by 15 deg about x"].make(campaign(sound))
    (found,) = find_undone(made.robot, made.readings, made.marker)
    assert "the sensor looks tilted by 15 deg about (-1.0" in str(found)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("campaign_of", "name", "said"),
    [
        (1, "markers counted from a preload", "read under 21% of the first press of each pose"),
        (2, "tool slips by 0.4 mm", "the tool seems to slip by 0.29 mm with the force across it"),
        (2, "sensor compressed by 35 %", "gain seems to fall with its load, by 50% at the largest"),
    ],
)
def test_what_presses_and_references_hide_is_named(campaign_of, name, said):
    made = KNOWN[name].make(campaign(MADE_OUTSIDE[campaign_of]))
    (found,) = find_undone(made.robot, made.readings, made.marker)
    assert said in str(found)


def test_what_is_dropped_below_a_threshold_is_no_load_cell_of_one_axis_and_no_rounding():
    made = campaign(ON_RAIL)
    R = made.robot.forward(made.readings.joint_position)[:, :3, :3]
    own = np.einsum("rji,rj->ri", R, made.readings.force)
    one = np.where(np.abs(own) == np.abs(own).max(axis=1, keepdims=True), own, 0.0)
    for kept in (one, np.round(own, -1)):
        force = np.einsum("rij,rj->ri", R, kept)
        found = find_implausible(made.robot, changed(made, force=force).readings, made.marker)
        assert not any("exactly zero" in str(each) for each in found)


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


def test_the_documentation_shows_every_mistake_from_outside():
    require_whole("outside", found=0.88, named=0.9, most_alarms=0.0)


@pytest.mark.slow
def test_a_tool_weight_is_named_once():
    made = KNOWN["weight of the tool left in"].make(campaign(ON_RAIL))
    model, rng = ElasticModel(made.robot, bearing(made.robot)), np.random.default_rng(0)
    found = calibrate(
        model, made.readings, rng, FitOptions(draws=40), marker_offset=made.marker
    ).warnings
    assert sum("seem to contain a constant" in text for text in found) == 1
