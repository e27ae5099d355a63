"""The elements of a URDF, checked by name: links, joints, and the joints of a chain."""

import math
import xml.etree.ElementTree as ElementTree
from collections import Counter

from elastocal.errors import RobotError, nearest
from elastocal.units import impossible, parse_number
from elastocal.wording import listed

_NUMBERS = {
    "origin": {"xyz": 3, "rpy": 3},
    "axis": {"xyz": 3},
    "limit": {"lower": 1, "upper": 1, "effort": 1, "velocity": 1},
    "mass": {"value": 1},
    "box": {"size": 3},
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
    "mesh": {"scale": 3},
}
"""How many numbers each attribute of each element holds (ROS wiki, urdf/XML)."""
_DIMENSIONS = {
    ("origin", "xyz"): "length",
    ("origin", "rpy"): "angle",
    ("mass", "value"): "mass",
    ("box", "size"): "length",
    ("sphere", "radius"): "length",
    ("cylinder", "radius"): "length",
    ("cylinder", "length"): "length",
}
"""Of those whose size is bounded: limits of joints often hold 1e16 for "none"."""
_AXIS_LENGTHS = (1e-6, 1e6)
"""Lengths of a joint's axis: its square must neither vanish nor overflow when it is normed."""
_MOVABLE = ("revolute", "continuous", "prismatic")


def check_elements(root: ElementTree.Element) -> None:
    """Refuse numbers that are none, and names that are missing or stand twice.

    What only a drawing needs is not looked at; axes and limits are where a joint moves.

    Raises
    ------
    RobotError
        With the link or joint, the element and its value.
    """
    for kind in ("link", "joint"):
        _check_names(root, kind)
    for link in root.findall("link"):
        for part in (*link.findall("inertial"), *link.findall("collision")):
            for element in part.iter():
                _check_numbers(f"link {link.get('name')!r}", element)
    for joint in root.findall("joint"):
        for element in joint.findall("origin"):
            _check_numbers(f"joint {joint.get('name')!r}", element)


def _check_names(root: ElementTree.Element, kind: str) -> None:
    names = [element.get("name", "") for element in root.findall(kind)]
    unnamed = [index for index, name in enumerate(names) if not name.strip()]
    if unnamed:
        raise RobotError(f"URDF: {_place(root, kind, unnamed[0])} has no name")
    twice = sorted(name for name, times in Counter(names).items() if times > 1)
    if twice:
        raise RobotError(f"URDF has two {kind}s named {twice[0]!r}")


def _place(root: ElementTree.Element, kind: str, index: int) -> str:
    """Return where a link or joint without a name stands, in words."""
    element = root.findall(kind)[index]
    ends = (element.find(role) for role in ("parent", "child"))
    linked = " to ".join(repr(end.get("link", "")) for end in ends if end is not None)
    return f"{kind} {index + 1} of the file{f', from {linked},' if linked else ''}"


def _check_numbers(owner: str, element: ElementTree.Element) -> None:
    for name, count in _NUMBERS.get(element.tag, {}).items():
        text = element.get(name)
        if text is None:
            continue
        values = _floats(text)
        # A limit may be infinite, as several exporters write "none".
        finite = all(map(math.isfinite, values)) or element.tag == "limit"
        if len(values) != count or not finite or any(map(math.isnan, values)):
            what = "a finite number" if count == 1 else f"{count} finite numbers"
            raise RobotError(f"URDF {owner}: <{element.tag} {name}={text!r}> must be {what}")
        if element.tag == "axis" and not any(values):
            raise RobotError(f"URDF {owner}: <axis xyz={text!r}> must not be zero")
        low, high = _AXIS_LENGTHS
        if element.tag == "axis" and not low <= math.hypot(*values) <= high:
            raise RobotError(
                f"URDF {owner}: <axis xyz={text!r}> must have a length from {low:g} to {high:g}"
            )
        dimension = _DIMENSIONS.get((element.tag, name))
        problem = impossible(dimension, *values) if dimension else None
        if problem is not None:
            raise RobotError(f"URDF {owner}: <{element.tag} {name}={text!r}> is {problem}")


def _floats(text: str) -> list[float]:
    """Return the numbers of an attribute; none where Python is alone in reading one."""
    if "_" in text or not text.isascii():
        return []
    try:
        return [parse_number(part) for part in text.split()]
    except ValueError:
        return []


def link_names(root: ElementTree.Element) -> list[str]:
    return [link.get("name", "") for link in root.findall("link")]


def link_of(joint: ElementTree.Element, role: str) -> str:
    element = joint.find(role)
    if element is None or not element.get("link"):
        raise RobotError(f"URDF joint {joint.get('name')!r} has no {role} link")
    return element.get("link", "")


def joints_by_child(root: ElementTree.Element) -> dict[str, ElementTree.Element]:
    """Return the joint that carries each link, by the name of the link.

    Raises
    ------
    RobotError
        If two joints carry the same, or a joint names a link that is not there.
    """
    links = dict.fromkeys(link_names(root))
    joint_to: dict[str, ElementTree.Element] = {}
    for joint in root.findall("joint"):
        for role in ("parent", "child"):
            name = link_of(joint, role)
            if name not in links:
                raise RobotError(
                    f"URDF joint {joint.get('name')!r}: no link {name!r} ({role})"
                    f"{nearest(name, links)} (links: {listed(list(links))})"
                )
        first = joint_to.setdefault(link_of(joint, "child"), joint)
        if first is not joint:
            raise RobotError(
                f"URDF link {link_of(joint, 'child')!r} is the child of two joints,"
                f" {first.get('name')!r} and {joint.get('name')!r}: links must form a tree"
            )
    return joint_to


def joints_between(
    joint_to: dict[str, ElementTree.Element], base: str, tip: str
) -> list[ElementTree.Element]:
    """Return the movable joints from base to tip, checked one by one."""
    joints: list[ElementTree.Element] = []
    link, seen = tip, set[str]()
    while link != base:
        joint = joint_to.get(link)
        if joint is None or link in seen:
            raise RobotError(f"URDF has no chain from base link {base!r} to tip link {tip!r}")
        seen.add(link)
        if is_movable(joint):
            joints.append(joint)
        link = link_of(joint, "parent")
    if not joints:
        raise RobotError(f"URDF has no movable joint between {base!r} and {tip!r}")
    return joints[::-1]


def is_movable(joint: ElementTree.Element) -> bool:
    """Return whether a joint of a chain moves.

    Raises
    ------
    RobotError
        If it is none that a chain may have.
    """
    name, kind, limit = joint.get("name"), joint.get("type"), joint.find("limit")
    if kind == "fixed":
        return False
    if kind not in _MOVABLE:
        raise RobotError(
            f"URDF joint {name!r} is {kind}: the chain may have revolute, continuous, prismatic"
            " and fixed joints"
        )
    if joint.find("mimic") is not None:
        raise RobotError(f"URDF joint {name!r} mimics another one: not possible inside the chain")
    if kind != "continuous" and limit is None:
        raise RobotError(f"URDF joint {name!r} is {kind} and has no <limit>")
    for element in joint:
        _check_numbers(f"joint {name!r}", element)
    limits = limits_of(joint)
    if not limits["lower"] <= limits["upper"]:
        raise RobotError(
            f"URDF joint {name!r}: <limit lower={limits['lower']:g} upper={limits['upper']:g}>:"
            " lower must not be above upper"
        )
    return True


def limits_of(joint: ElementTree.Element) -> dict[str, float]:
    """Return the limits of a movable joint in rad or m; infinite or NaN where not known."""
    limit = joint.find("limit")
    texts = {} if limit is None else limit.attrib
    lower, upper, velocity, effort = (
        float(texts.get(name, "0")) for name in ("lower", "upper", "velocity", "effort")
    )
    if joint.get("type") == "continuous":
        lower, upper = -math.inf, math.inf
    return {
        "lower": lower,
        "upper": upper,
        "velocity": velocity if 0.0 < velocity < math.inf else math.nan,
        "effort": effort if 0.0 < effort < math.inf else math.nan,
    }
