"""The robot catalogue: dimensions, limits and masses of robots, each with its source.

The table `robots.yaml` beside this file is the only copy of the numbers; the URDF is made from it
on demand. What has no source says so in `Robot.assumptions`.
"""

import difflib
import functools
import importlib.resources
import re
from collections.abc import Mapping
from typing import Any

from pydantic import Field

from elastocal.errors import RobotError, SchemaError
from elastocal.records import StrictModel, from_data, read_yaml_data, validate
from elastocal.robot.catalogue.arm_urdf import urdf_of
from elastocal.robot.catalogue.record import (
    CatalogueEntry,
    Dimensions,
    Maker,
    ParallelEntry,
    WristEntry,
    inertias_like,
)
from elastocal.robot.robot import Robot

_FILE = "robots.yaml"
SCHEMA = "elastocal.catalogue/1"
_MAKERS: Mapping[Maker, re.Pattern[str]] = {
    "KUKA": re.compile(r"\b(kuka|kr ?\d+|lbr)\b", re.IGNORECASE),
    "ABB": re.compile(r"\b(abb|irb ?\d*)\b", re.IGNORECASE),
    "FANUC": re.compile(r"\b(fanuc|(r|m|lr) ?(mate )?\d+ ?i[a-d])", re.IGNORECASE),
    "Staeubli": re.compile(r"\b(sta?eubli|staubli|stäubli|(rx|tx)2?[ -]?\d+)", re.IGNORECASE),
    "Universal Robots": re.compile(r"\b(universal robots?|ur ?\d{1,2}e?)\b", re.IGNORECASE),
}
"""How makers name their robots, in words."""
_SUGGESTED = 3
"""Most names that are proposed for one that is not known."""
_ALIKE = 0.4
"""Least likeness of these, from 0 to 1; few letters and other digits are alike enough."""


def names() -> tuple[str, ...]:
    """Return the names of all robots, in the order of the table."""
    return tuple(_entries())


def entry(name: str) -> CatalogueEntry:
    """Return what is known of a robot, with the sources.

    Parameters
    ----------
    name : str
        For example ``"KR 120 R2700-2"``; case, spaces, hyphens and underscores do not matter.

    Raises
    ------
    RobotError
        If no robot has that name, with the nearest names and where all are listed.
    """
    table = _entries()
    by_key = {_key(known): known for known in table}
    known = by_key.get(_key(name))
    if known is None:
        raise RobotError(
            f"no robot {name!r} in the catalogue{_suggestion(name, table)} (`elastocal robots`"
            " lists them; any other robot is given as a URDF file)"
        )
    return table[known]


def maker_of(name: str) -> Maker | None:
    """Return the maker of a robot by its name, in the catalogue or as its maker names others.

    >>> maker_of("my_irb_4600"), maker_of("arm")
    ('ABB', None)

    Parameters
    ----------
    name : str
        Of the robot, as its URDF has it.
    """
    for known, robot in _entries().items():
        if _key(known) == _key(name):
            return robot.maker
    words = re.sub(r"[\s_./-]+", " ", name)
    return next((maker for maker, how in _MAKERS.items() if how.search(words)), None)


def urdf(name: str) -> str:
    """Return the URDF of a robot; see `elastocal.robot.catalogue.arm_urdf`."""
    return urdf_of(entry(name))


def load(name: str, tip: str = "flange") -> Robot:
    """Return a robot ready to compute with.

    >>> load("kr 210 r2700-2").joint_names[:2]
    ('joint_a1', 'joint_a2')

    Parameters
    ----------
    name : str
        See `entry`.
    tip : str
        Link to take as the tool centre point; to add a tool, see `elastocal.robot.mounting`.

    Raises
    ------
    RobotError
        If no robot has that name, or it has no such link.
    """
    return Robot.from_urdf(urdf(name), tip)


class _CatalogueTable(StrictModel):
    """All keys of a table but ``schema``."""

    sources: dict[str, str] = Field(default_factory=dict)
    """Texts to refer to by aliases."""
    robots: tuple[dict[str, Any], ...]


def read_table(data: object, what: str) -> dict[str, CatalogueEntry]:
    """Return the robots of a table by name.

    Parameters
    ----------
    data : object
        What its YAML holds: `schema`, free `sources` to refer to, and the list `robots`.
    what : str
        Name of the table, for messages.

    Raises
    ------
    SchemaError
        If the table has another schema, a robot does not fit `CatalogueEntry`, two have the
        same name, or an inertia is ``like`` a robot that has no inertia of its own.
    """
    robots = from_data(_CatalogueTable, data, what, SCHEMA).robots
    by_name = {str(robot.get("name")): robot for robot in robots}
    if len(by_name) != len(robots):
        raise SchemaError(f"{what}: two robots have the same name")
    return {name: _entry(name, by_name, what) for name in by_name}


@functools.cache
def _entries() -> dict[str, CatalogueEntry]:
    """Return the robots of the package by name, in the order of the table."""
    with importlib.resources.as_file(importlib.resources.files(__package__) / _FILE) as path:
        return read_table(read_yaml_data(path), _FILE)


def _entry(name: str, by_name: Mapping[str, Mapping[str, Any]], what: str) -> CatalogueEntry:
    """Return one robot; masses that are ``like`` a sister's are estimated from hers."""
    robot = by_name[name]
    sister_name = _inertia(robot).get("like")
    if sister_name is not None:
        if "links" not in _inertia(by_name.get(str(sister_name), {})):
            raise SchemaError(
                f"{what}: inertia of {name} is like {sister_name!r}, which has none of its own"
            )
        arm = validate(robot.get("dimensions"), Dimensions, f"{what}: {name}")
        sister = validate(by_name[str(sister_name)], WristEntry, f"{what}: {sister_name}")
        robot = {**robot, "inertia": inertias_like(sister, arm)}
    dimensions = robot.get("dimensions")
    parallel = isinstance(dimensions, Mapping) and "d6" in dimensions
    return validate(robot, ParallelEntry if parallel else WristEntry, f"{what}: {name}")


def _inertia(robot: Mapping[str, Any]) -> Mapping[str, Any]:
    found = robot.get("inertia")
    return found if isinstance(found, Mapping) else {}


def _key(name: str) -> str:
    return re.sub(r"[\s_./-]+", "", name).casefold()


def _suggestion(name: str, table: Mapping[str, CatalogueEntry]) -> str:
    """Return what a name may stand for: the robots of that family or maker, or the nearest."""
    key, by_key = _key(name), {_key(known): known for known in table}
    family = [known for each, known in by_key.items() if key and key in each]
    if not family:
        family = [known for known, robot in table.items() if _key(robot.maker) == key]
    if not family:
        maker = next((maker for maker, how in _MAKERS.items() if how.search(name)), None)
        known = [each for each in by_key if maker in (None, table[by_key[each]].maker)]
        keys = difflib.get_close_matches(key, known, n=_SUGGESTED, cutoff=_ALIKE)
        few = known if maker and len(known) <= _SUGGESTED else ()
        family = [by_key[each] for each in keys or few]
    return f"; did you mean {', '.join(map(repr, family))}?" if family else ""
