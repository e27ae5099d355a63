"""Show the robots of the catalogue as blocks: what is known of each, and from which source."""

from collections.abc import Iterator, Sequence

import numpy as np

from elastocal.blocks import Block, Cell, Facts, Graded, Paragraph, Table
from elastocal.records import record
from elastocal.robot.catalogue.catalogue import entry, load
from elastocal.units import quantity
from elastocal.wording import phrase, phrases


@record()
class JointFacts:
    """A joint in SI units; an unknown number is None."""

    name: str
    lower: float | None
    upper: float | None
    velocity: float | None
    effort: float | None


@record()
class RobotFacts:
    """What the catalogue knows of a robot."""

    name: str
    reach: float
    """In m."""
    joints: tuple[JointFacts, ...]
    sources: dict[str, str]
    """By the field that they are of."""
    assumptions: dict[str, str]
    """Reasons for what has no source, by the field."""


def robot_facts(name: str) -> RobotFacts:
    """Return what the catalogue knows of a robot.

    Raises
    ------
    RobotError
        If it has none of that name.
    """
    robot, known = load(name), entry(name)
    limits = robot.limits
    ranges = zip(limits.lower, limits.upper, limits.velocity, limits.effort, strict=True)
    joints = tuple(
        JointFacts(joint, *(float(value) if np.isfinite(value) else None for value in values))
        for joint, values in zip(robot.joint_names, ranges, strict=True)
    )
    assumed = {each.field: each.reason for each in robot.assumptions}
    return RobotFacts(known.name, known.reach, joints, dict(known.sources), assumed)


def show_robots(robots: Sequence[RobotFacts]) -> Iterator[Block]:
    """Yield a row a robot, and what the words in it mean."""
    heads = phrases("Robot", "Reach", "Limits", "Speeds", "Torques", "Masses")
    rows = tuple(
        (each.name, f"{each.reach:.3f} m" if each.reach else "-", *_marks(each)) for each in robots
    )
    yield Table(phrase("Robots of the catalogue"), heads, rows)
    yield Paragraph(
        phrase(
            "sourced: from a named source; assumed: no source, never used silently; -: not known."
            " `elastocal robots NAME` shows every source."
        )
    )


def show_robot(robot: RobotFacts) -> Iterator[Block]:
    """Yield the joints of a robot and the source of each number."""
    rows = tuple(
        (
            each.name,
            *(_quantity(value, "°") for value in (each.lower, each.upper)),
            "-" if each.velocity is None else f"{_quantity(each.velocity, '°')}/s",
            "-" if each.effort is None else f"{each.effort:.0f} N·m",
        )
        for each in robot.joints
    )
    yield Table(robot.name, phrases("Joint", "From", "To", "Speed", "Torque"), rows)
    yield Facts(
        (
            *((f"source of {field}", text) for field, text in robot.sources.items()),
            *((f"assumed {field}", text) for field, text in robot.assumptions.items()),
        )
    )


def _marks(robot: RobotFacts) -> tuple[Cell, ...]:
    fields = (("position", "lower"), ("velocity", "velocity"), ("effort", "effort"))
    marks = (
        _mark(
            field in robot.assumptions,
            all(getattr(joint, key) is not None for joint in robot.joints),
        )
        for field, key in fields
    )
    return (*marks, _mark("inertia" in robot.assumptions, True))


def _mark(assumed: bool, known: bool) -> Cell:
    if not known:
        return "-"
    return Graded("assumed", "fair") if assumed else Graded("sourced", "good")


def _quantity(value: float | None, unit: str) -> str:
    return "-" if value is None else quantity(value, unit, ".1f")
