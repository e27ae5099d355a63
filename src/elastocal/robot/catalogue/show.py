"""Show the robots of the catalogue as blocks: what is known of each, and from which source."""

from collections.abc import Iterable, Iterator

import numpy as np

from elastocal.blocks import Block, Cell, Facts, Graded, Paragraph, Table
from elastocal.robot.catalogue.catalogue import entry, load
from elastocal.robot.robot import Robot
from elastocal.units import quantity
from elastocal.wording import phrase, phrases


def robot_figures(name: str) -> dict[str, object]:
    """Return a robot's entry in the catalogue as JSON data; None: not known.

    Raises
    ------
    RobotError
        If it has none of that name.
    """
    robot, known = load(name), entry(name)
    return {
        "name": known.name,
        "maker": known.maker,
        "reach": known.reach,
        "joints": [
            {"name": joint} | dict(zip(_LIMITS, limits, strict=True))
            for joint, limits in _limits(robot)
        ],
        "sources": dict(known.sources),
        "assumptions": {each.field: each.reason for each in robot.assumptions},
    }


def show_robots(names: Iterable[str]) -> Iterator[Block]:
    """Yield a row a robot, and what the words in it mean."""
    heads = phrases("Robot", "Maker", "Reach", "Limits", "Speeds", "Torques", "Masses")
    entries = map(entry, names)
    rows = tuple(
        (
            each.name,
            each.maker,
            f"{each.reach:.3f} m" if each.reach else "-",
            *_marks(load(each.name)),
        )
        for each in entries
    )
    yield Table(phrase("Robots of the catalogue"), heads, rows)
    yield Paragraph(
        phrase(
            "sourced: from a named source; assumed: no source, never used silently; -: not known."
            " `elastocal robots NAME` shows every source."
        )
    )


def show_robot(name: str) -> Iterator[Block]:
    """Yield the joints of a robot and the source of each number."""
    robot, known = load(name), entry(name)
    rows = tuple(
        (
            joint,
            *(_quantity(value, "°") for value in (lower, upper)),
            "-" if velocity is None else f"{_quantity(velocity, '°')}/s",
            "-" if effort is None else f"{effort:.0f} N·m",
        )
        for joint, (lower, upper, velocity, effort) in _limits(robot)
    )
    yield Table(known.name, phrases("Joint", "From", "To", "Speed", "Torque"), rows)
    yield Facts(
        (
            *((f"source of {field}", text) for field, text in known.sources.items()),
            *((f"assumed {each.field}", each.reason) for each in robot.assumptions),
        )
    )


_LIMITS = ("lower", "upper", "velocity", "effort")


def _limits(robot: Robot) -> Iterator[tuple[str, tuple[float | None, ...]]]:
    """Yield the name of each joint and its limits in SI units; None: not known."""
    rows = zip(*(getattr(robot.limits, key) for key in _LIMITS), strict=True)
    for name, row in zip(robot.joint_names, rows, strict=True):
        yield name, tuple(float(value) if np.isfinite(value) else None for value in row)


def _marks(robot: Robot) -> tuple[Cell, ...]:
    """Return whether limits, speeds, torques and masses have a source."""
    fields = (("position", "lower"), ("velocity", "velocity"), ("effort", "effort"))
    assumed = {each.field for each in robot.assumptions}
    marks = (
        _mark(field in assumed, bool(np.isfinite(getattr(robot.limits, key)).all()))
        for field, key in fields
    )
    return (*marks, _mark("inertia" in assumed, True))


def _mark(assumed: bool, known: bool) -> Cell:
    if not known:
        return "-"
    return Graded("assumed", "fair") if assumed else Graded("sourced", "good")


def _quantity(value: float | None, unit: str) -> str:
    return "-" if value is None else quantity(value, unit, ".1f")
