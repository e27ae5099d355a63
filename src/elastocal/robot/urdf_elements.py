"""Check the numbers and names of a URDF before a parser that reports on the C++ error stream."""

import math
import xml.etree.ElementTree as ElementTree

from elastocal.errors import RobotError

_NUMBERS = {
    "origin": {"xyz": 3, "rpy": 3},
    "axis": {"xyz": 3},
    "limit": {"lower": 1, "upper": 1, "effort": 1, "velocity": 1},
    "mass": {"value": 1},
    "inertia": dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), 1),
    "box": {"size": 3},
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
    "mesh": {"scale": 3},
}
"""How many numbers each attribute of each element holds (ROS wiki, urdf/XML)."""


def check_elements(root: ElementTree.Element) -> None:
    """Refuse numbers that are none and names that stand twice.

    Raises
    ------
    RobotError
        With the link or joint, the element and its value.
    """
    for kind in ("link", "joint"):
        names = [element.get("name", "") for element in root.findall(kind)]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise RobotError(f"URDF has two {kind}s named {twice[0]!r}")
        for owner in root.findall(kind):
            for element in owner.iter():
                _check_numbers(f"{kind} {owner.get('name')!r}", element)
    links = {link.get("name", "") for link in root.findall("link")}
    for joint in root.findall("joint"):
        for role in ("parent", "child"):
            found = joint.find(role)
            name = "" if found is None else found.get("link", "")
            if name and name not in links:
                raise RobotError(f"URDF joint {joint.get('name')!r}: no link {name!r} ({role})")


def _check_numbers(owner: str, element: ElementTree.Element) -> None:
    for name, count in _NUMBERS.get(element.tag, {}).items():
        text = element.get(name)
        if text is None:
            continue
        try:
            values = [float(part) for part in text.split()]
        except ValueError:
            values = []
        if len(values) != count or not all(math.isfinite(value) for value in values):
            what = "a finite number" if count == 1 else f"{count} finite numbers"
            raise RobotError(f"URDF {owner}: <{element.tag} {name}={text!r}> must be {what}")
        if element.tag == "axis" and not any(values):
            raise RobotError(f"URDF {owner}: <axis xyz={text!r}> must not be zero")
