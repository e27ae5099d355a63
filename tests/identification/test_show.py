"""What is said of springs beside the table of their values."""

from dataclasses import replace

from elastocal.elastic import Gear
from elastocal.identification import ladder_sentence, show_unseen, spring_table
from elastocal.identification.figures import DifferenceSummary, RungSummary, SpringSummary
from elastocal.identification.show import show_ladder
from elastocal.report import language_of

KNOWN = SpringSummary("joint_1.axial", "hinge", "rad/(N*m)", 4e-7, 3.9e-7, 4.1e-7, True)
AT_BOUND = SpringSummary(
    "joint_4.axial", "hinge", "rad/(N*m)", 0.0, 0.0, 1.98e-6, True, at_bound=True
)


def told(*springs: SpringSummary) -> str:
    return " ".join(str(block) for block in show_unseen(springs, ((), ()), (2, 2, 2), 12.0))


def test_a_spring_that_a_bound_decides_is_not_said_to_be_observable():
    assert "Every spring is observable" in told(KNOWN)
    assert "Every spring is observable" not in told(KNOWN, AT_BOUND)
    assert "a bound decides the value of 1 spring: joint_4.axial" in told(KNOWN, AT_BOUND)


def test_a_spring_at_its_bound_is_not_rigid_where_its_interval_says_how_soft_it_may_be():
    rows = spring_table([KNOWN, AT_BOUND, replace(AT_BOUND, high=0.0)]).rows
    assert [row[3] for row in rows] == ["2.500", "above 0.505", "rigid"]


def test_further_rows_of_a_gear_are_said_in_other_languages_without_its_name():
    gear = Gear("joint_a2.axial", "joint_a2", axis=(0.0, 0.0, 1.0), slips=(5.0,))
    names = (*(each.name for each in gear.characteristics), "joint_a2.axial of a plug-in")
    rows = spring_table([replace(KNOWN, name=name) for name in names]).rows
    english = ["joint_a2.axial", "at 1000 N·m", "lost motion", "of a plug-in"]
    assert [row[0].strip() for row in rows] == english
    german = [language_of("de").say(row[0]).strip() for row in rows[1:3]]
    assert german == ["bei 1000\xa0N·m", "Umkehrspiel"]


LADDER = (
    RungSummary("actuated", 2e-4, DifferenceSummary(9e-5, 2e-5, 1.6e-4), 6, False),
    RungSummary("links", 1e-4, DifferenceSummary(0.0, 0.0, 0.0), 37, True),
    RungSummary("tensor", 9e-5, DifferenceSummary(-1e-5, -3e-5, -2e-6), 37, False),
    RungSummary("gears", 8e-5, DifferenceSummary(-2e-5, -3e-5, -1e-5), 52, False, backed=False),
)
"""Of the last two the first has more numbers than the readings, the second is unsure."""


def test_a_model_that_may_not_be_taken_is_not_the_best_though_it_errs_less():
    said = ladder_sentence(LADDER)
    assert said.startswith("links is taken, the best at left-out poses")
    assert "too unsure of production to be taken: gears;" in said
    assert "better, but with more numbers than the readings hold: tensor;" in said
    assert "not told apart" not in said


def test_the_ladder_counts_from_the_best_that_may_be_taken_in_every_language():
    (table,) = show_ladder(LADDER)
    assert [row[3] for row in table.rows][2] == "-10.0 µm (-30.0 to -2.0)"
    said = {name: language_of(name).say(table.heads[3]) for name in ("en", "de", "fr")}
    assert said == {
        "en": "Above the best allowed",
        "de": "Über dem besten erlaubten",
        "fr": "Au-dessus du meilleur admis",
    }
