"""URDF texts of arms whose geometry is known by construction.

The link frames are deliberately not those of a textbook: what is derived from these texts has
to come from the joint axes. The last link is always `tcp`, its z axis out of the tool.
"""

import math
from collections.abc import Sequence

import coal
import numpy as np
import pinocchio as pin

HALF_TURN = (-math.pi, math.pi)
WALL = "0.2 -0.4 1.5", "0 1.5707963267948966 0.3"
CEILING = "0.5 0.1 3.0", "3.141592653589793 0 0.7"
"""Mounts as `xyz, rpy` of the arm's foot in the base link."""
FLOOR = "0 0 0", "0 0 0"

KR_LIKE = {"a1": 0.35, "a2": -0.041, "b": 0.0, "c1": 0.675, "c2": 1.15, "c3": 1.2, "c4": 0.215}
"""A heavy arm of about 2.7 m reach."""

_UP, _ACROSS = "0 0 1", "0 1 0"
_OPW_AXES = (_UP, _ACROSS, _ACROSS, _UP, _ACROSS, _UP)


def opw_arm_urdf(  # noqa: PLR0913 (the arm has seven lengths)
    a1: float,
    a2: float,
    b: float,
    c1: float,
    c2: float,
    c3: float,
    c4: float,
    *,
    signs: Sequence[int] = (1, 1, 1, 1, 1, 1),
    offsets: Sequence[float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    limits: Sequence[tuple[float, float]] = (HALF_TURN,) * 6,
    mount: tuple[str, str] = FLOOR,
    rail: tuple[float, float] | None = None,
    turntable: tuple[float, float] | None = None,
    wrist_offset: float = 0.0,
    skew: float = 0.0,
    name: str = "arm",
) -> str:
    """Return an arm with ortho-parallel basis and spherical wrist, lengths in m.

    Its OPW angles are `signs * q + offsets`. `rail` and `turntable` are the limits of external
    axes `rail` (along y of the foot) and `table` (about its z). `wrist_offset` displaces axis
    6 from the wrist centre along x, `skew` turns axis 2 about x by so many rad: with either,
    the arm is none of its kind any more.
    """
    origins = [
        (0.0, 0.0, 0.0),
        (a1, 0.0, c1),
        (0.0, 0.0, c2),
        (a2, b, c3),
        (0.0, 0.0, 0.0),
        (wrist_offset, 0.0, 0.0),
    ]
    axes = [_signed(axis, sign) for axis, sign in zip(_OPW_AXES, signs, strict=True)]
    parts = [_fixed("mount", "base", "foot", *mount)]
    parent = "foot"
    if rail is not None:
        parts.append(_joint("rail", parent, "carriage", "0 0 0.1", "0 0 0", _ACROSS, rail, True))
        parent = "carriage"
    if turntable is not None:
        parts.append(_joint("table", parent, "plate", "0.3 0 0.2", "0 0 0", _UP, turntable))
        parent = "plate"
    for number, (origin, axis, limit) in enumerate(zip(origins, axes, limits, strict=True), 1):
        # The zero of a joint is turned by a fixed rotation before it.
        angle = offsets[number - 1]
        rpy = f"0 {angle!r} 0" if _OPW_AXES[number - 1] == _ACROSS else f"0 0 {angle!r}"
        if number == 2 and skew:
            rpy = f"{skew!r} {angle!r} 0"
        child = f"link_{number}"
        parts.append(_joint(f"joint_{number}", parent, child, _text(origin), rpy, axis, limit))
        parent = child
    parts.append(_fixed("tool", parent, "tcp", _text((0.0, 0.0, c4)), "0 0 0"))
    return _robot(name, parts)


def offset_wrist_urdf(*, rail: tuple[float, float] | None = None) -> str:
    """Return a six-axis arm whose axis 6 misses the wrist centre by 80 mm."""
    return opw_arm_urdf(**KR_LIKE, wrist_offset=0.08, rail=rail, name="offset_wrist")


def sliding_arm_urdf() -> str:
    """Return a Stanford arm: turn, tilt, slide (0.2 to 1.2 m), spherical wrist."""
    parts = [
        _joint("turn", "base", "link_1", "0 0 0.5", "0 0 0", _UP, HALF_TURN),
        _joint("tilt", "link_1", "link_2", "0 0.15 0", "0 0 0", _ACROSS, HALF_TURN),
        _joint("slide", "link_2", "link_3", "0 0 0", "0 0 0", _UP, (0.2, 1.2), True),
        _joint("roll", "link_3", "link_4", "0 0 0", "0 0 0", _UP, HALF_TURN),
        _joint("bend", "link_4", "link_5", "0 0 0", "0 0 0", _ACROSS, HALF_TURN),
        _joint("spin", "link_5", "link_6", "0 0 0", "0 0 0", _UP, HALF_TURN),
        _fixed("tool", "link_6", "tcp", "0 0 0.2", "0 0 0"),
    ]
    return _robot("sliding_arm", parts)


def planar_arm_urdf(lengths: Sequence[float] = (1.0, 0.7, 0.2)) -> str:
    """Return a three-joint arm that moves in the x-z plane; joints about y."""
    parts, parent, origin = [], "base", "0 0 0"
    for number, length in enumerate(lengths, 1):
        child = f"link_{number}"
        name = f"joint_{number}"
        parts.append(_joint(name, parent, child, origin, "0 0 0", _ACROSS, HALF_TURN))
        parent, origin = child, _text((length, 0.0, 0.0))
    parts.append(_fixed("tool", parent, "tcp", origin, "0 1.5707963267948966 0"))
    return _robot("planar_arm", parts)


def _signed(axis: str, sign: int) -> str:
    return axis if sign > 0 else axis.replace("1", "-1")


def _text(numbers: Sequence[float]) -> str:
    return " ".join(repr(float(number)) for number in numbers)


def _joint(
    name: str,
    parent: str,
    child: str,
    xyz: str,
    rpy: str,
    axis: str,
    limit: tuple[float, float],
    slides: bool = False,
) -> str:
    kind = "prismatic" if slides else "revolute"
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>'
        f'<limit lower="{float(limit[0])}" upper="{float(limit[1])}" effort="0" velocity="0"/>'
        "</joint>"
    )


def _fixed(name: str, parent: str, child: str, xyz: str, rpy: str) -> str:
    return (
        f'<joint name="{name}" type="fixed"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/></joint>'
    )


def _robot(name: str, parts: Sequence[str]) -> str:
    links = ["base"]
    for part in parts:
        links.append(part.split('<child link="')[1].split('"')[0])
    listed = "".join(f'<link name="{link}"/>' for link in links)
    return f'<robot name="{name}">{listed}{"".join(parts)}</robot>'


def colliding_links(urdf: str, q: np.ndarray) -> list[tuple[str, str]]:
    """Return the pairs of links, not neighbours, whose shapes touch."""
    model = pin.buildModelFromXML(urdf)
    shapes = pin.buildGeomFromUrdfString(model, urdf, pin.GeometryType.COLLISION)
    data = shapes.createData()
    pin.updateGeometryPlacements(model, model.createData(), shapes, data, q)
    objects = shapes.geometryObjects
    hits = []
    for i, first in enumerate(objects):
        for j, second in enumerate(objects[:i]):
            if abs(first.parentJoint - second.parentJoint) < 2:
                continue
            at_first, at_second = (
                coal.Transform3s(data.oMg[k].rotation, data.oMg[k].translation) for k in (i, j)
            )
            result = coal.CollisionResult()
            request = coal.CollisionRequest()
            if coal.collide(first.geometry, at_first, second.geometry, at_second, request, result):
                hits.append((first.name, second.name))
    return hits
