"""Which column of a path holds what (spec section 4, ``PATH.csv``)."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from elastocal.dataset import joint_dimensions
from elastocal.errors import CompensationError, UnitError, nearest
from elastocal.results import brief_repr
from elastocal.robot import Robot
from elastocal.tables import Column
from elastocal.units import factor, split_column

_AXES = ("x", "y", "z")
_EULER = ("a", "b", "c")
_QUATERNION = ("qx", "qy", "qz", "qw")
_FORCES = ("force_", "force_tcp_")
_MOMENTS = ("moment_", "moment_tcp_")
"""In base axes, and in those of the programmed tcp."""
_EXAMPLES = {"angle": "deg", "length": "mm", "force": "N", "moment": "N*m"}
_Found = Mapping[str, tuple[tuple[int, str | None], ...]]


class PathError(CompensationError):
    """A programmed path that cannot be corrected; the message names its line or point."""


@contextmanager
def in_file(path: Path) -> Iterator[None]:
    """Name the file in a refusal that comes up inside.

    Raises
    ------
    PathError
        The same with the file's name before it.
    """
    try:
        yield
    except PathError as error:
        raise PathError(f"{path}: {error}") from error


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

    @property
    def by_pose(self) -> bool:
        """Whether the path is one of tcp poses, else of joints."""
        return bool(self.position)


def find_columns(header: Sequence[str], robot: Robot, forces: bool = True) -> PathColumns:
    """Return the columns of a path by what they hold.

    Parameters
    ----------
    header : sequence of str
        Names with units.
    robot : Robot
        Whose joints the path may have.
    forces : bool
        Whether a path without forces is refused.

    Raises
    ------
    PathError
        If a column is missing, stands twice, has no unit or a wrong one, or the path has both
        joints and poses, or forces both in base and in the tcp frame, or neither.
    """
    found = _split(header)
    dimensions = joint_dimensions(robot.joint_names, robot.revolute)
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
        raise PathError(_neither(found, robot))
    names = robot.joint_names if arm else tuple(name for name in external if name in found)
    joints = tuple(_column(found, name, dimensions[name]) for name in names)
    if names and not arm and names != external:
        missing = next(name for name in external if name not in names)
        raise PathError(f"column '{missing}[…]' is missing: a path gives all external axes or none")
    position = () if arm else tuple(_column(found, name, "length") for name in _AXES)
    return PathColumns(
        joints, position, () if arm else _orientation(found), *_wrenches(found, forces)
    )


def find_wrench_columns(header: Sequence[str]) -> tuple[WrenchColumns, WrenchColumns | None]:
    """Return the columns of the force, and of the moment if there are any.

    Raises
    ------
    PathError
        As for `find_columns`.
    """
    force, moment = _wrenches(_split(header), True)
    if force is None:
        raise PathError("path has no forces")
    return force, moment


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
        return Column(index, name, unit, factor(unit, dimension))
    except UnitError as error:
        raise PathError(f"column '{name}[{unit}]': {error}") from error


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
    force = _wrench(found, "force", _FORCES, forces)
    return force, _wrench(found, "moment", _MOMENTS, False)


def _wrench(
    found: _Found, dimension: str, prefixes: tuple[str, str], required: bool
) -> WrenchColumns | None:
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


def _neither(found: _Found, robot: Robot) -> str:
    joints = ", ".join(f"{name}[…]" for name in robot.joint_names)
    return (
        f"path has neither the joints of {robot.name} ({joints}) nor a tcp pose (x[mm] y[mm] z[mm]"
        f" with a[deg] b[deg] c[deg] or qx qy qz qw); its columns are {', '.join(found)}"
    )
