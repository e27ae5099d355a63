"""What is said of springs beside the table of their values."""

from dataclasses import replace

from elastocal.identification import show_unseen, spring_table
from elastocal.identification.figures import SpringSummary
from elastocal.report import language_of
from elastocal.wording import phrase

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
    names = (
        phrase("joint_a2.axial"),
        phrase("{spring} at {torque} N·m", spring="joint_a2.axial", torque="340"),
        phrase("{spring} lost motion", spring="joint_a2.axial"),
        "joint_a2.axial of a plug-in",
    )
    rows = spring_table([replace(KNOWN, name=name) for name in names]).rows
    english = ["joint_a2.axial", "at 340 N·m", "lost motion", "of a plug-in"]
    assert [row[0].strip() for row in rows] == english
    german = [language_of("de").say(row[0]).strip() for row in rows[1:3]]
    assert german == ["bei 340\xa0N·m", "Umkehrspiel"]
