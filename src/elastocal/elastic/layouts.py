"""Spring layouts: the springs of a robot, by a name or from a YAML file.

A new named layout is a function ``(robot) -> springs`` here, an entry in `LAYOUTS`, a line in the
changelog and an entry in ``tests/contracts/test_layouts.py``. A spring file:

    schema: elastocal.springs/1
    include: actuated            # optional: start from a named layout
    springs:
      - {joint: joint_a2, axis: x}                          # torsion, bearing housing
      - {joint: joint_a3, axis: [0, 1, 1], frame: distal}   # any axis, behind the joint
      - {joint: joint_a6, axis: z, kind: prismatic, offset: ["0 mm", "0 mm", "150 mm"]}
      - {joint: joint_a2, stiffness: "1.2 MN*m/rad", uncertainty: "20 %"}   # of a data sheet
      - {joint: joint_a1, bounds: ["0.5 MN*m/rad", "5 MN*m/rad"]}
      - {joint: joint_a4, kind: gear, K1: "0.3 MN*m/rad", uncertainty: "30 %"}
      - {joint: joint_a5, kind: gear, settings: {knees: [100, 300, 900]}}   # fields of the kind

The virtual springs of a joint are at its Hartenberg-Denavit origin (paper Eq. 2).

The origin of a joint is where the common normal with the axis before it meets its own axis (J.
Angeles, *Fundamentals of Robotic Mechanical Systems*, 2014, section 4.2). It depends on the two
axes only, not on the frame of a URDF: sliding a joint frame along its axis, or turning it about the
axis, changes nothing. Special cases:

* parallel axes have many common normals: the one through the previous origin counts. Axes are
  taken as parallel up to `PARALLEL`, beyond which a calibrated arm's nearly parallel axes would
  meet kilometres away;
* the first axis has none before it: the foot of the base's origin on it, and the base's axes;
* a prismatic joint has a direction and no place: the axes on its two sides are neighbours, at
  the position zero of the joint.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from os import PathLike
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BeforeValidator, Field, model_validator

from elastocal.arrays import FloatArray
from elastocal.elastic.known import Knowledge, KnownSpring
from elastocal.elastic.springs import (
    AXES,
    DEFAULT_KIND,
    KINDS,
    Hinge,
    Spring,
    SpringAxis,
    Tensor,
    as_axis,
    axial,
    coordinate_axis,
    spring_at,
)
from elastocal.errors import SpringError, require_type
from elastocal.files import as_path
from elastocal.options import CHOICES
from elastocal.plugins import Registry
from elastocal.records import StrictModel, read_yaml
from elastocal.results import brief_repr
from elastocal.robot import ChainJoint, Robot, SerialChain
from elastocal.units import parse_quantity

PARALLEL = 1e-2
"""Angle in rad below which two axes count as parallel."""
_SHORTEST_LINK = 1e-2
"""Distance in m below which two origins have no link between them."""
_SAME_AXIS = 1e-6
"""Distance in m below which two parallel axes count as one line."""

_Triple = tuple[float, float, float]


@brief_repr
@dataclass(frozen=True)
class JointOrigin:
    """Origin of a joint and the directions of its virtual springs, in the joint's frame."""

    offset: _Triple
    """The origin in the joint's proximal frame, in m."""
    far: _Triple
    """Point on the axis where the common normal with the next axis, or for the last joint the one
    through the tip, meets it, in m; the origin again where axes are parallel."""
    directions: dict[str, _Triple]
    """Unit vectors orthogonal to the joint axis by name: the common normal, and the direction
    orthogonal to it. Named after the frame's coordinate axes where they are those, else
    ``normal`` and ``binormal``."""


@brief_repr
@dataclass(frozen=True)
class LinkMiddle:
    """The middle of the link behind a joint, in the joint's frame behind its motion."""

    joint: str
    """Name of the joint in front of the link."""
    middle: _Triple
    """Half-way to the next joint's origin, in m."""
    directions: dict[str, _Triple]
    """Unit vectors orthogonal to the link by name, as those of `JointOrigin`."""


def joint_origins(chain: SerialChain) -> tuple[JointOrigin, ...]:
    """Return the Hartenberg-Denavit origin of every joint of a chain."""
    return tuple(_origins(chain))


def link_middles(chain: SerialChain) -> tuple[LinkMiddle, ...]:
    """Return the middle of every link between two joints of a chain that has a length.

    A link runs from one Hartenberg-Denavit origin to the next, so that neither its middle nor its
    directions depend on how joints are drawn: one is the part of the axis in front of it that is
    orthogonal to it, or of the axis behind where the first runs along it.
    """
    return tuple(_middles(chain))


def _middles(chain: SerialChain) -> Iterator[LinkMiddle]:
    frames, axes, _ = _at_zero(chain)
    origins = [
        T[:3, :3] @ np.array(origin.offset) + T[:3, 3]
        for T, origin in zip(frames, joint_origins(chain), strict=True)
    ]
    for k, (start, end) in enumerate(pairwise(origins)):
        length = float(np.linalg.norm(end - start))
        if length < _SHORTEST_LINK:
            continue
        along = (end - start) / length
        across = [axis - along * float(axis @ along) for axis in axes[k : k + 2]]
        first = next((n for n in across if np.linalg.norm(n) > PARALLEL), _transverse(along))
        first = first / np.linalg.norm(first)
        R, drawn = frames[k][:3, :3], frames[k][:3, 3]
        yield LinkMiddle(
            chain.joints[k].name,
            _triple(R.T @ (0.5 * (start + end) - drawn)),
            _named(R.T @ first, R.T @ np.cross(along, first)),
        )


def _at_zero(chain: SerialChain) -> tuple[list[FloatArray], list[FloatArray], FloatArray]:
    """Return frames and axes of the joints and the tip in base, at positions zero."""
    frames = list(accumulate((joint.placement for joint in chain.joints), np.matmul))
    axes = [T[:3, :3] @ joint.axis for T, joint in zip(frames, chain.joints, strict=True)]
    return frames, axes, (frames[-1] @ chain.T_last_tip)[:3, 3]


def _origins(chain: SerialChain) -> Iterator[JointOrigin]:
    frames, axes, tip = _at_zero(chain)
    before: tuple[FloatArray, FloatArray] | None = None
    for k, (joint, T_base_joint, axis) in enumerate(zip(chain.joints, frames, axes, strict=True)):
        R, drawn = T_base_joint[:3, :3], T_base_joint[:3, 3]
        origin, normal = _meeting(axis, drawn, before)
        far = _foot(tip, axis, drawn)
        if k + 1 < len(axes):
            crossing = float(np.linalg.norm(np.cross(axis, axes[k + 1]))) > PARALLEL
            following = axes[k + 1], frames[k + 1][:3, 3]
            far = _meeting(axis, drawn, following)[0] if crossing else origin
        yield JointOrigin(
            _triple(R.T @ (origin - drawn)),
            _triple(R.T @ (far - drawn)),
            _named(R.T @ normal, R.T @ np.cross(axis, normal)),
        )
        if joint.revolute:
            before = axis, origin


def _meeting(
    axis: FloatArray, point: FloatArray, before: tuple[FloatArray, FloatArray] | None
) -> tuple[FloatArray, FloatArray]:
    """Return the origin on an axis through a point, and the unit normal there, in base."""
    if before is None:
        return _foot(np.zeros(3), axis, point), _transverse(axis)
    previous, start = before
    across = np.cross(previous, axis)
    sine = float(np.linalg.norm(across))
    if sine > PARALLEL:
        # Where the plane of the previous axis and the common normal cuts the axis.
        off_plane = np.cross(previous, across)
        travel = float(off_plane @ (point - start)) / float(off_plane @ axis)
        return point - travel * axis, across / sine
    origin = _foot(start, axis, point)
    normal = origin - start
    distance = float(np.linalg.norm(normal))
    return origin, normal / distance if distance > _SAME_AXIS else _transverse(axis)


def _foot(of: FloatArray, axis: FloatArray, point: FloatArray) -> FloatArray:
    """Return the point of a line that is nearest to a point."""
    return np.asarray(point + axis * float(axis @ (of - point)))


def _transverse(axis: FloatArray) -> FloatArray:
    """Return the base's coordinate axis least aligned with an axis, made orthogonal to it."""
    least = np.eye(3)[int(np.argmin(np.round(np.abs(axis), 9)))]
    normal = least - axis * float(axis @ least)
    return np.asarray(normal / np.linalg.norm(normal))


def _named(normal: FloatArray, binormal: FloatArray) -> dict[str, _Triple]:
    """Return two directions by name, coordinate axes in their order and positive."""
    found: list[tuple[str, ArrayLike]] = []
    for name, direction in (("normal", normal), ("binormal", binormal)):
        along = coordinate_axis(direction)
        found.append((name, direction) if along is None else (along, AXES[along]))
    pairs = sorted(found, key=lambda pair: pair[0]) if found[0][0] in AXES else found
    return {name: as_axis(direction) for name, direction in pairs}


def _triple(vector: FloatArray) -> _Triple:
    # A picometre is a rounding, and a zero has no sign.
    x, y, z = (float(round(value, 12)) + 0.0 for value in vector)
    return x, y, z


_SCHEMA = "elastocal.springs/1"
_APART = 1e-3
"""Distance in m from which two places on an axis are two."""
_MOTIONS = ("revolute", "prismatic")
"""Motions of a hinge; other kinds of springs are requested by name."""


def actuated(robot: Robot) -> tuple[Spring, ...]:
    """Return one axial spring per joint (6 on a 6R arm; the model of paper section 4.2.4)."""
    return tuple(axial(joint) for joint in robot.chain.joints)


def bearing(robot: Robot) -> tuple[Spring, ...]:
    """Return the paper's lumped kinetostatic model (section 4.1; 18 springs on a 6R arm).

    Order: all axial springs, then the virtual ones joint by joint, the paper's
    ``[c_a; c_v]`` of Eq. 11. The virtual ones sit at the Hartenberg-Denavit origins
    (`elastocal.elastic.layouts`), so that they do not depend on where a joint's frame is drawn.
    """
    return (*actuated(robot), *_tilts(robot))


def bearing_ends(robot: Robot) -> tuple[Spring, ...]:
    """Return the bearing layout with springs at both ends of each joint's own axis.

    A joint tilts in bearings that sit somewhere along its axis, and links bend between joints. A
    tilt at the Hartenberg-Denavit origin, where the common normal with the axis before meets it,
    and one at the end where that with the axis behind does, share out what lies between. Where
    both ends are one place there is one pair of springs.
    """
    return (*actuated(robot), *_tilts(robot, both_ends=True))


def links(robot: Robot) -> tuple[Spring, ...]:
    """Return the layout of both bearing ends with links that bend.

    A beam bends along its whole length, which springs at its ends describe badly, since their lever
    arms to the tcp differ. Two hinges in the middle of each link represent the bending.
    """
    bends = (
        Hinge(f"{link.joint}.bend-{name}", link.joint, axis, distal=True, offset=link.middle)
        for link in link_middles(robot.chain)
        for name, axis in link.directions.items()
    )
    axial_ones, tilts = actuated(robot), bearing_ends(robot)[len(robot.joint_names) :]
    order = {name: index for index, name in enumerate(robot.joint_names)}
    return (*axial_ones, *sorted((*tilts, *bends), key=lambda spring: order[spring.joint]))


def _tilts(robot: Robot, both_ends: bool = False) -> Iterator[Spring]:
    """Yield the virtual springs at Hartenberg-Denavit origins, and at the far ends if asked."""
    for joint, origin in zip(robot.chain.joints, joint_origins(robot.chain), strict=True):
        places = {"": origin.offset}
        if both_ends and np.linalg.norm(np.subtract(origin.far, origin.offset)) > _APART:
            places["far-"] = origin.far
        for end, place in places.items():
            for name, axis in origin.directions.items():
                yield Hinge(f"{joint.name}.{end}{name}", joint.name, axis, offset=place)


def bearing_joint(robot: Robot, distal: bool = False) -> tuple[Spring, ...]:
    """Return the same with the virtual springs at the origins of the URDF's joint frames.

    Their directions are the coordinate axes of those frames; the answer depends on how the URDF
    was drawn.

    Parameters
    ----------
    distal : bool
        Put the virtual springs behind each joint's motion instead of in the bearing housing.
    """
    virtual = (
        Hinge(f"{joint.name}.{name}", joint.name, axis, distal=distal)
        for joint in robot.chain.joints
        for name, axis in orthogonal_axes(joint.axis).items()
    )
    return (*actuated(robot), *virtual)


def tensor(robot: Robot) -> tuple[Spring, ...]:
    """Return a symmetric compliance tensor at every joint that turns, at its origin.

    It describes more than 18 springs of any directions can: bearings that tilt about axes other
    than those of the frame. Origins are the Hartenberg-Denavit ones. Prismatic joints have a linear
    spring, first, and no tensor: its compliance would depend on the position along the rail. A
    carriage that tilts is in the tensor of the joint that it carries.
    """
    pairs = list(zip(robot.chain.joints, joint_origins(robot.chain), strict=True))
    sliding = tuple(axial(joint) for joint, _ in pairs if not joint.revolute)
    turning = (
        Tensor(f"{joint.name}.tensor", joint.name, origin.offset)
        for joint, origin in pairs
        if joint.revolute
    )
    return (*sliding, *turning)


def orthogonal_axes(axis: ArrayLike) -> dict[str, tuple[float, float, float]]:
    """Return the two named axes of the virtual springs of a joint with this axis.

    They are the coordinate axes orthogonal to the joint axis. For an axis that is not a
    coordinate axis: the two coordinate axes least aligned with it, made orthonormal to it
    (Gram-Schmidt, the least aligned first) and still named after them.

    >>> orthogonal_axes([0, 1, 0])
    {'x': (1.0, 0.0, 0.0), 'z': (0.0, 0.0, 1.0)}
    """
    unit = np.asarray(as_axis(axis))
    alignment = np.abs(unit)
    along = coordinate_axis(unit)
    if along is not None:
        return {name: AXES[name] for name in AXES if name != along}
    first, second = np.argsort(alignment, kind="stable")[:2]
    names = list(AXES)
    made: dict[str, tuple[float, float, float]] = {}
    basis = [unit]
    for index in (first, second):
        vector = np.asarray(AXES[names[index]])
        for other in basis:
            vector = vector - (vector @ other) * other
        basis.append(vector / np.linalg.norm(vector))
        made[names[index]] = as_axis(basis[-1])
    return dict(sorted(made.items()))


_OWN: dict[str, Callable[[Robot], tuple[Spring, ...]]] = {
    "actuated": actuated,
    "bearing": bearing,
    "bearing-joint": bearing_joint,
    "bearing-ends": bearing_ends,
    "links": links,
    "tensor": tensor,
}
LAYOUTS: Registry[Callable[[Robot], tuple[Spring, ...]]] = Registry(
    "spring layout", _OWN, SpringError
)
"""Layouts by name."""


def layout(
    robot: Robot, name: str | PathLike[str], beside: Sequence[str] = ()
) -> tuple[Spring, ...]:
    """Return the springs of a layout by name, or of a YAML file by its path.

    Parameters
    ----------
    name : str or path-like
        Name or path.
    beside : sequence of str
        Words that the caller takes as well, for the refusal of others.

    Raises
    ------
    SpringError
        If the name is neither a layout nor a file.
    """
    require_type(robot, Robot, "robot", "Robot")
    path = as_path(name, "name", "name of a layout")
    name = str(name)
    if _of_readings(name) and not beside:
        raise SpringError(
            f"spring layout {name!r} is made from readings: springs={name!r} of calibrate takes it,"
            f" not layout() (allowed: {', '.join(LAYOUTS)}, or a .yaml file)"
        )
    if name in LAYOUTS or path.suffix not in (".yaml", ".yml"):
        return LAYOUTS.named(name, beside, ", or a .yaml file")(robot)
    return tuple(spring for spring, _ in _springs_of(robot, read_springs(path)))


def _of_readings(name: str) -> bool:
    """Return whether springs of that name depend on readings too."""
    word = name.partition("+")[0]
    return word in CHOICES["springs"] and word not in LAYOUTS


def known_springs(robot: Robot, name: str) -> tuple[KnownSpring, ...]:
    """Return the springs that a spring file knows; none for a layout by name.

    Raises
    ------
    SpringError
        If it does not fit a spring.
    SchemaError, FileAccessError
        If the file cannot be read or does not fit.
    """
    if Path(name).suffix not in (".yaml", ".yml"):
        return ()
    pairs = _springs_of(robot, read_springs(Path(name)))
    return tuple(
        known
        for spring, entry in pairs
        if entry and entry.knows
        for known in entry.of_spring(spring)
    )


def _springs_of(robot: Robot, file: "SpringFile") -> list[tuple[Spring, "SpringEntry | None"]]:
    """Return the springs of a file with their entries; included ones may have none."""
    included: tuple[Spring, ...] = LAYOUTS[file.include](robot) if file.include else ()
    listed: dict[Spring, SpringEntry] = {}
    for spring, entry in zip(custom(robot, file.springs), file.springs, strict=True):
        if spring in listed:
            raise SpringError(f"spring {spring.name!r} is listed twice")
        listed[spring] = entry
    # An entry that states prior knowledge of an included spring is no second spring.
    knowledge = {spring: entry for spring, entry in listed.items() if entry.knows}
    found = [(spring, knowledge.get(spring)) for spring in included]
    return found + [
        (s, entry) for s, entry in listed.items() if s not in included or s not in knowledge
    ]


def _words(known: Callable[[], Iterable[str]]) -> BeforeValidator:
    """Return the check that a text is one of the known words."""

    def check(text: Any) -> Any:
        *others, last = [repr(word) for word in known()]
        if text not in known():
            raise ValueError(f"Input should be {', '.join(others)} or {last}")
        return text

    return BeforeValidator(check)


_Length = Annotated[float, BeforeValidator(lambda text: parse_quantity(text, "length"))]
_LayoutName = Annotated[str, _words(lambda: tuple(LAYOUTS))]
_Kind = Annotated[
    str, _words(lambda: (*_MOTIONS, *(word for word in KINDS if word != DEFAULT_KIND)))
]


class SpringEntry(Knowledge):
    """Entry of a spring file."""

    joint: str
    axis: Literal["axial", "x", "y", "z"] | tuple[float, float, float] = "axial"
    kind: _Kind | None = None
    """Default: a torsional hinge; one of the joint's own motion for ``axial``."""
    frame: Literal["proximal", "distal"] = "proximal"
    offset: tuple[_Length, _Length, _Length] = (0.0, 0.0, 0.0)
    name: str | None = None
    settings: dict[str, Any] = Field(default={})
    """Fields of the kind in SI units, other than those that say where the spring is."""

    @model_validator(mode="after")
    def _require_a_kind_with_settings(self) -> "SpringEntry":
        if self.settings and self.kind in (None, *_MOTIONS):
            raise ValueError("settings are for a kind of spring that has some: name it by kind")
        return self


class SpringFile(StrictModel):
    """A spring file."""

    include: _LayoutName | None = None
    springs: tuple[SpringEntry, ...] = Field(default=())


def read_springs(path: Path) -> SpringFile:
    """Return a validated spring file.

    Raises
    ------
    SchemaError, FileAccessError
        If the file cannot be read or does not fit.
    """
    return read_yaml(path, SpringFile, _SCHEMA)


def custom(robot: Robot, entries: tuple[SpringEntry, ...]) -> tuple[Spring, ...]:
    """Return the springs that a file lists for a robot, in its order."""
    joints = {joint.name: joint for joint in robot.chain.joints}
    return tuple(_spring(entry, joints) for entry in entries)


def _spring(entry: SpringEntry, joints: dict[str, ChainJoint]) -> Spring:
    if entry.joint not in joints:
        raise SpringError(f"spring at joint {entry.joint!r}: the robot has {', '.join(joints)}")
    joint = joints[entry.joint]
    usual = joint.revolute if entry.axis == "axial" else True
    revolute = entry.kind == "revolute" if entry.kind in _MOTIONS else usual
    if entry.kind == "gear" and entry.axis == "axial" and not joint.revolute:
        raise SpringError(f"spring at joint {joint.name!r}: a gear turns, and this joint slides")
    axis, distal = _axis(entry, joint), entry.frame == "distal"
    # The name says what distinguishes a spring, e.g. x, distal-x, linear-z.
    parts = [] if entry.kind in (None, *_MOTIONS) else [str(entry.kind)]
    parts += [] if revolute == usual else ["torsion" if revolute else "linear"]
    parts += ["distal"] if distal else []
    parts += [entry.axis if isinstance(entry.axis, str) else _direction(axis)]
    name = entry.name or f"{joint.name}.{'-'.join(parts)}"
    place = SpringAxis(name, joint.name, axis, revolute, distal, entry.offset)
    if entry.kind in (None, *_MOTIONS):
        return Hinge.at(place)
    return spring_at(str(entry.kind), place, entry.settings)


def _axis(entry: SpringEntry, joint: ChainJoint) -> tuple[float, float, float]:
    if entry.axis == "axial":
        return axial(joint).axis
    return AXES[entry.axis] if isinstance(entry.axis, str) else as_axis(entry.axis)


def _direction(axis: tuple[float, float, float]) -> str:
    return "(" + " ".join(f"{component:.3g}" for component in axis) + ")"
