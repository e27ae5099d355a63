"""Layout from a YAML file: any list of springs.

Example::

    schema: elastocal.springs/1
    include: actuated            # optional: start from a named layout
    springs:
      - {joint: joint_a2, axis: x}                          # torsion, bearing housing
      - {joint: joint_a3, axis: [0, 1, 1], frame: distal}   # any axis, behind the joint
      - {joint: joint_a6, axis: z, kind: prismatic, offset: ["0 mm", "0 mm", "150 mm"]}
"""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from elastocal.elastic.springs import AXES, Spring, as_axis, axial
from elastocal.errors import SpringError
from elastocal.records import StrictModel, read_yaml
from elastocal.robot import ChainJoint, Robot
from elastocal.units import parse_quantity

SCHEMA = "elastocal.springs/1"

Length = Annotated[float, BeforeValidator(lambda text: parse_quantity(text, "length"))]


class SpringEntry(StrictModel):
    """One spring as a person writes it."""

    joint: str
    axis: Literal["axial", "x", "y", "z"] | tuple[float, float, float] = "axial"
    kind: Literal["revolute", "prismatic"] | None = None
    """Default: revolute; the joint's own kind for ``axial``."""
    frame: Literal["proximal", "distal"] = "proximal"
    offset: tuple[Length, Length, Length] = (0.0, 0.0, 0.0)
    name: str | None = None


class SpringFile(StrictModel):
    """A spring file."""

    include: Literal["actuated", "bearing"] | None = None
    springs: tuple[SpringEntry, ...] = Field(default=())


def read_springs(path: Path) -> SpringFile:
    """Return a validated spring file.

    Raises
    ------
    SchemaError, FileAccessError
        If the file cannot be read or does not fit.
    """
    return read_yaml(path, SpringFile, SCHEMA)


def custom(robot: Robot, entries: tuple[SpringEntry, ...]) -> tuple[Spring, ...]:
    """Return the springs that a file lists for a robot, in its order."""
    joints = {joint.name: joint for joint in robot.chain.joints}
    return tuple(_spring(entry, joints) for entry in entries)


def _spring(entry: SpringEntry, joints: dict[str, ChainJoint]) -> Spring:
    if entry.joint not in joints:
        raise SpringError(f"spring at joint {entry.joint!r}: the robot has {', '.join(joints)}")
    joint = joints[entry.joint]
    distal = entry.frame == "distal"
    usual = joint.revolute if entry.axis == "axial" else True
    revolute = usual if entry.kind is None else entry.kind == "revolute"
    axis = _axis(entry, joint)
    # A name tells what distinguishes a spring, e.g. x, distal-x, linear-z.
    parts = [] if revolute == usual else ["torsion" if revolute else "linear"]
    parts += ["distal"] if distal else []
    parts += [entry.axis if isinstance(entry.axis, str) else _direction(axis)]
    name = entry.name or f"{joint.name}.{'-'.join(parts)}"
    return Spring(name, joint.name, axis, revolute, distal, entry.offset)


def _axis(entry: SpringEntry, joint: ChainJoint) -> tuple[float, float, float]:
    if entry.axis == "axial":
        return axial(joint).axis
    return AXES[entry.axis] if isinstance(entry.axis, str) else as_axis(entry.axis)


def _direction(axis: tuple[float, float, float]) -> str:
    return "(" + " ".join(f"{component:.3g}" for component in axis) + ")"
