"""Columns of a table of joints or poses with a wrench, by its header, and the allowed numbers.

A row is an instant. It has the robot's joints, or a pose of the tcp (beside one, columns of
external axes), and the force on the robot, in base or in axes of the programmed tcp; and optionally
a moment.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from elastocal.errors import PathError, UnitError, nearest
from elastocal.results import brief_repr
from elastocal.robot import Robot
from elastocal.tables import Column
from elastocal.units import dimension_of_unit, factor, largest, split_column

LARGEST_FORCE, LARGEST_MOMENT = 1e5, 1e5
"""In N and N·m: a larger number is beyond any sensor on a robot, hence no reading."""
_BEYOND = 0.1
"""Distance from a joint's limit, in rad or m, that the limits of a drawing may be wrong by; degrees
that were called radians lie farther off."""
_AXES = ("x", "y", "z")
_EULER = ("a", "b", "c")
_QUATERNION = ("qx", "qy", "qz", "qw")
_EXAMPLES = {"angle": "deg", "length": "mm", "force": "N", "moment": "N*m", "time": "s"}
_NO_JOINTS = re.compile(r"[xyzabc]|deflection_.*|(controller|marker)_.*|tcp_.*")
"""Columns of an angle or a length that are no joints."""
_Found = Mapping[str, tuple[tuple[int, str | None], ...]]


@dataclass(frozen=True)
class WrenchColumns:
    """Three columns of a force or a moment on the robot at the tcp."""

    columns: tuple[Column, Column, Column]
    in_tcp: bool
    """Whether in axes of the programmed tcp, else in base."""


@brief_repr
@dataclass(frozen=True)
class PathColumns:
    """The columns that are read; all others are carried through."""

    joints: tuple[Column, ...]
    """All joints, or the external axes of a path of poses; these may be none (held)."""
    position: tuple[Column, ...]
    """x, y, z of the tcp in base; none in a path of joints."""
    orientation: tuple[Column, ...]
    """a, b, c or qx, qy, qz, qw; none in a path of joints."""
    force: WrenchColumns | None
    """None only where forces are not asked for."""
    moment: WrenchColumns | None
    robot: Robot | None = None
    """Robot to which the joints belong; None: not known."""

    @property
    def by_pose(self) -> bool:
        """Whether the path is one of tcp poses, else of joints."""
        return bool(self.position)


def find_columns(
    header: Sequence[str], robot: Robot, forces: bool = True, poses: bool = True
) -> PathColumns:
    """Return the columns of a path by what they hold.

    Parameters
    ----------
    header : sequence of str
        Names with units.
    robot : Robot
        Whose joints the path may have.
    forces : bool
        Whether a path without forces is refused.
    poses : bool
        Whether it may have poses of the tcp instead of joints.

    Raises
    ------
    PathError
        If a column is missing, is repeated, has no unit or a wrong one, or the path has both joints
        and poses, or forces both in base and in the tcp frame, or neither.
    """
    found = _split(header)
    if not poses:
        joints = _joints(found, robot, robot.joint_names)
        return PathColumns(joints, (), (), *_wrenches(found, forces), robot)
    external = robot.joint_names[: robot.external_axes]
    arm = [name for name in robot.joint_names[robot.external_axes :] if name in found]
    pose = [
        name
        for name in (*_AXES, *_EULER, *_QUATERNION)
        if name in found and name not in robot.joint_names
    ]
    if arm and {*_AXES} <= set(pose):
        raise PathError(
            f"path has both joints ({', '.join(arm)}) and a tcp pose ({', '.join(pose)}): keep one"
        )
    if not arm and not pose:
        known = ", ".join(f"{name}[…]" for name in robot.joint_names)
        raise PathError(
            f"path has neither the joints of {robot.name} ({known}) nor a tcp pose (x[mm] y[mm]"
            " z[mm] with a[deg] b[deg] c[deg] or qx qy qz qw); its columns are"
            f" {', '.join(found)}"
        )
    names = robot.joint_names if arm else tuple(name for name in external if name in found)
    joints = _joints(found, robot, names)
    if names and not arm and names != external:
        missing = next(name for name in external if name not in names)
        raise PathError(f"column '{missing}[…]' is missing: a path gives all external axes or none")
    position = () if arm else tuple(_column(found, name, "length") for name in _AXES)
    orientation = () if arm else _orientation(found)
    return PathColumns(joints, position, orientation, *_wrenches(found, forces), robot)


def find_wrench_columns(header: Sequence[str]) -> PathColumns:
    """Return the columns of the force alone, and of the moment if there are any.

    Raises
    ------
    PathError
        As for `find_columns`.
    """
    return PathColumns((), (), (), *_wrenches(_split(header), True))


def find_posture_columns(header: Sequence[str], robot: Robot | None) -> PathColumns:
    """Return the columns of static postures: the flange's orientation, or joints; and a wrench.

    Raises
    ------
    PathError
        As for `find_columns`; if there is neither an orientation nor a robot.
    """
    found = _split(header)
    if any({*names} <= {*found} for names in (_EULER, _QUATERNION)):
        columns = PathColumns((), (), _orientation(found), *_wrenches(found, True))
    elif robot is not None:
        columns = find_columns(header, robot, poses=False)
    else:
        raise PathError(
            "no orientation of the flange (a[deg] b[deg] c[deg], or qx qy qz qw): give --robot for"
            " a file with joints"
        )
    if columns.force is not None and columns.force.in_tcp:
        raise PathError("force_tcp_x …: forces of static postures are the sensor's, force_x[N] …")
    return columns


def guess_columns(header: Sequence[str]) -> PathColumns:
    """Return the columns of rows of a robot that is not at hand.

    Joints are those columns of an angle or a length that have no other meaning in a table of ours.

    Raises
    ------
    PathError
        As for `find_columns`.
    """
    found = _split(header)
    turned = any({*names} <= {*found} for names in (_EULER, _QUATERNION))
    position = _AXES if turned and {*_AXES} <= {*found} else ()
    joints = [
        _column(found, name, dimension)
        for name, ((_, unit), *_) in found.items()
        if (dimension := dimension_of_unit(unit or "")) in ("angle", "length")
        and not _NO_JOINTS.fullmatch(name)
    ]
    return PathColumns(
        tuple(joints),
        tuple(_column(found, name, "length") for name in position),
        _orientation(found) if turned else (),
        *_wrenches(found, True),
    )


def find_time(header: Sequence[str]) -> Column | None:
    """Return the column of the time of each row; None where there is none.

    Raises
    ------
    PathError
        If it is repeated, has no unit or a wrong one.
    """
    found = _split(header)
    return _column(found, "time", "time") if "time" in found else None


def find_names(header: Sequence[str], name: str) -> int | None:
    """Return the index of a column of names, such as ``course``; None if there is none.

    Raises
    ------
    PathError
        If it is repeated, has a unit or a nearly equal name.
    """
    found = _split(header)
    if name in found:
        ((index, unit), *more) = found[name]
        if more:
            raise PathError(f"column {name!r} stands twice in the header")
        if unit is not None:
            raise PathError(f"column {name!r} is written without a unit, not in {unit}")
        return index
    for other in found:
        # Carried through as any other column it would be lost, unseen.
        if other.casefold().removesuffix("s") == name:
            raise PathError(f"column {other!r} is written {name!r}")
    return None


def plausible_range(column: Column, robot: Robot | None) -> tuple[float, float, str]:
    """Return the least and largest number that a column can mean, in SI units, and why.

    Parameters
    ----------
    column : Column
        A joint, a coordinate, a component of a wrench, a time.
    robot : Robot or None
        Whose joint it may be.
    """
    if robot is not None and column.name in robot.joint_names:
        joint, (most, name) = robot.joint_names.index(column.name), largest(column.dimension)
        low, high = float(robot.limits.lower[joint]), float(robot.limits.upper[joint])
        if math.isfinite(low) and math.isfinite(high):
            return low - _BEYOND, high + _BEYOND, "about the limits of the joint"
        return max(-most, low), min(most, high), f"a joint within {name}"
    if column.dimension in ("force", "moment"):
        most = LARGEST_FORCE if column.dimension == "force" else LARGEST_MOMENT
        return -most, most, "what a robot can feel"
    if not column.dimension:
        return -math.inf, math.inf, "any number"
    most, name = largest(column.dimension)
    return -most, most, f"at most {name}"


def joint_dimensions(names: Sequence[str], revolute: Sequence[bool]) -> dict[str, str]:
    """Return the dimension of each joint's position, by name."""
    return {
        name: "angle" if turns else "length" for name, turns in zip(names, revolute, strict=True)
    }


def _split(header: Sequence[str]) -> _Found:
    """Return place and unit of every column, by name; one that cannot be split is not ours."""
    found: dict[str, tuple[tuple[int, str | None], ...]] = {}
    for index, cell in enumerate(header):
        try:
            name, unit = split_column(cell)
        except UnitError:
            continue
        found[name] = (*found.get(name, ()), (index, unit))
    return found


def _column(found: _Found, name: str, dimension: str | None) -> Column:
    """Return one column; ``dimension`` None is a plain number."""
    if name not in found:
        example = f"[{_EXAMPLES[dimension]}]" if dimension else ""
        raise PathError(
            f"column '{name}{example}' is missing{nearest(name, found)}"
            f" (columns: {', '.join(found)})"
        )
    if len(found[name]) > 1:
        raise PathError(f"column {name!r} stands twice in the header")
    index, unit = found[name][0]
    if dimension is None:
        if unit is not None:
            raise PathError(f"column '{name}[{unit}]': a quaternion has no unit, write {name!r}")
        return Column(index, name, "", 1.0)
    if unit is None:
        raise PathError(
            f"column {name!r} has no unit: it is written {name}[{_EXAMPLES[dimension]}]"
        )
    try:
        return Column(index, name, unit, factor(unit, dimension), dimension)
    except UnitError as error:
        raise PathError(f"column '{name}[{unit}]': {error}") from error


def _joints(found: _Found, robot: Robot, names: Sequence[str]) -> tuple[Column, ...]:
    dimensions = joint_dimensions(robot.joint_names, robot.revolute)
    return tuple(_column(found, name, dimensions[name]) for name in names)


def _orientation(found: _Found) -> tuple[Column, ...]:
    given = [names for names in (_EULER, _QUATERNION) if any(name in found for name in names)]
    if len(given) > 1:
        raise PathError(
            f"path has both angles ({', '.join(_EULER)}) and a quaternion"
            f" ({', '.join(_QUATERNION)}): keep one"
        )
    if given == [_QUATERNION]:
        return tuple(_column(found, name, None) for name in _QUATERNION)
    return tuple(_column(found, name, "angle") for name in _EULER)


def _wrenches(found: _Found, forces: bool) -> tuple[WrenchColumns | None, WrenchColumns | None]:
    force = _wrench(found, "force", forces)
    return force, _wrench(found, "moment", False)


def _wrench(found: _Found, dimension: str, required: bool) -> WrenchColumns | None:
    """Return the columns of a force or a moment, in base or in axes of the programmed tcp."""
    prefixes = (f"{dimension}_", f"{dimension}_tcp_")
    given = [prefix for prefix in prefixes if any(f"{prefix}{axis}" in found for axis in _AXES)]
    in_base, in_tcp = (f"{prefix}x" for prefix in prefixes)
    if len(given) > 1:
        raise PathError(
            f"path has the {dimension} both in base ({in_base} …) and in the tcp frame"
            f" ({in_tcp} …): keep one"
        )
    if not given:
        if required:
            raise PathError(
                f"path has no forces: columns {in_base}[N] … (on the robot, in base) or"
                f" {in_tcp}[N] … (in the programmed tcp frame) are missing"
            )
        return None
    x, y, z = (_column(found, f"{given[0]}{axis}", dimension) for axis in _AXES)
    return WrenchColumns((x, y, z), given[0] == prefixes[1])
