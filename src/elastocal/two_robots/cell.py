"""The cell file of two robots: both arms, one base transform, and how they press on each other.

It is a cell file (``elastocal.cell/1``) with the key ``robots`` where one robot has ``robot``. The
first robot's base is the frame of all that belongs to both.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.resources import files
from os import PathLike
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, FiniteFloat, field_validator

from elastocal.arrays import FloatArray
from elastocal.cell import (
    IDENTITY,
    AngleUpToPi,
    Distance,
    Force,
    Length,
    Mass,
    Name,
    Point,
    Pose,
    PositiveForce,
    PositiveLength,
    RobotEntry,
    Share,
    TranslationalStiffness,
    mounted_robot,
)
from elastocal.errors import ElastocalError, SchemaError
from elastocal.files import read_text, write_text
from elastocal.identification import Contact, ContactEntry
from elastocal.records import StrictModel, from_data, parse_yaml
from elastocal.results import brief_repr
from elastocal.robot import Robot

SCHEMA = "elastocal.cell/1"
PAIR_FILE = "pair.json"
"""Record of a calibration of two robots, in one folder with the model file of each arm."""
_LEAST_APART = 0.2
"""Distance of two bases in m below which they would stand in each other."""


class ArmEntry(StrictModel):
    """One of the two robots."""

    name: Name
    """Name of the arm; its files are called so."""
    robot: RobotEntry
    tcp: Pose = IDENTITY
    """Tip that presses, in the flange frame, z out of the tool."""
    tool_mass: Mass = 0.0
    """Mass of the tool in kg, at the tcp: for the static torques that the planner checks."""
    model: str | None = None
    """Model file of an arm that is calibrated already, relative to the cell file."""


class PressEntry(StrictModel):
    """Loads with which the tools press on each other."""

    force: PositiveForce
    """Along the common normal, in N."""
    lateral: Force = 0.0
    """Across it, in two directions and both signs, in N; 0: none."""
    clamped: bool = False
    """Whether the tools are clamped to each other: they pull as well as press."""
    light: PositiveForce = 50.0
    """With which they touch where the zero is read, in N."""

    @property
    def cases(self) -> dict[str, FloatArray]:
        """Force on the first robot in its tcp frame by load case, in N; shape (3,) each."""
        fz, fx = self.force, self.lateral
        loads = {"normal": (0.0, 0.0, -fz), "half": (0.0, 0.0, -0.5 * fz)}
        if fx > 0.0:
            loads |= {"north": (fx, 0.0, -fz), "south": (-fx, 0.0, -fz)}
            loads |= {"east": (0.0, -fx, -fz), "west": (0.0, fx, -fz)}
        if self.clamped:
            loads |= {"pull": (0.0, 0.0, fz), "half pull": (0.0, 0.0, 0.5 * fz)}
        return {name: np.array(load) for name, load in loads.items()}


class VolumeEntry(StrictModel):
    """A box in the first robot's base in which the tools meet."""

    centre: Point
    size: tuple[PositiveLength, PositiveLength, PositiveLength]


class PairLimits(StrictModel):
    """Margins that both arms keep at every meeting."""

    joint_margin: AngleUpToPi = 0.0873
    """Least distance of a joint to its limits, in rad."""
    singular_value: Annotated[FiniteFloat, Field(ge=0.0, le=1.0)] = 0.05
    """Least singular value of the length-scaled Jacobian, without dimension."""
    torque: Annotated[FiniteFloat, Field(gt=0.0, le=1.0)] = 0.8
    """Share of the joint torques of the robot's description that may be used."""
    clearance: Distance = 0.35
    """Least distance of the lines through the joints of one arm from those of the other, in m; the
    links from the wrist to the tip are not judged, since these must meet."""


class SearchEntry(StrictModel):
    """Which meetings are chosen."""

    technique: str = "ioops"
    poses: Annotated[int, Field(ge=3, le=500)] = 31
    candidates: Annotated[int, Field(ge=10, le=100_000)] = 2000
    """Meetings that are tried."""
    seed: Annotated[int, Field(ge=0)] = 0


class ShareEntry(StrictModel):
    """How a correction is shared between the arms."""

    weights: tuple[Annotated[FiniteFloat, Field(ge=0.0)], Annotated[FiniteFloat, Field(ge=0.0)]] = (
        0.5,
        0.5,
    )
    """Parts of the relative deviation that each arm corrects; only their ratio counts."""
    limits: tuple[Distance, Distance] = (3e-3, 3e-3)
    """Largest correction of each arm, in m."""

    @field_validator("weights")
    @classmethod
    def _not_both_zero(cls, weights: tuple[float, float]) -> tuple[float, float]:
        if not sum(weights) > 0.0:
            raise ValueError("one of the two weights must be above 0")
        return weights


class PairSimulation(StrictModel):
    """Simulated arms, for `simulate-pair`; no estimate reads it."""

    seed: Annotated[int, Field(ge=0)] = 0
    softness: tuple[
        Annotated[FiniteFloat, Field(gt=0.0)], Annotated[FiniteFloat, Field(gt=0.0)]
    ] = (1.0, 1.2)
    """Compliance of each arm over that of an arm of 1.1 t."""
    stiffening: Share = 0.25
    """Part of the stiffness of a gear at high torque that is missing at rest."""
    bending: bool = True
    """Whether the two long links bend."""
    normal: TranslationalStiffness = 5e7
    """Stiffness of both tips together along the normal, in N/m."""
    across: TranslationalStiffness = 3.5e7
    """The same across it, in N/m."""
    spread: Share = 0.2
    """Standard deviation of a meeting from these, as a share."""
    stop: Distance = 1e-5
    """Standard deviation of a position of either controller, in m."""
    slip: Distance = 1e-6
    """Standard deviation of the creep from press to press, in m; 0 where the tools are clamped."""
    force_noise: Force = 1.0
    """Standard deviation of either force sensor, in N."""
    base_error: Length = 0.0
    """By how far the second base stands from where the cell file has it, along x, in m."""


class PairCellFile(StrictModel):
    """All keys of the cell file of two robots but ``schema``."""

    name: str = ""
    robots: tuple[ArmEntry, ...]
    """Two arms; the first one's base is the common frame."""
    base_transform: Pose
    """Base of the second robot in that of the first: T_first_second."""
    contact: ContactEntry
    """What is known of both tips together; see `Contact`."""
    presses: PressEntry
    volume: VolumeEntry
    limits: PairLimits = PairLimits()
    search: SearchEntry = SearchEntry()
    share: ShareEntry = ShareEntry()
    simulation: PairSimulation = PairSimulation()

    @field_validator("robots")
    @classmethod
    def _two_by_name(cls, robots: tuple[ArmEntry, ...]) -> tuple[ArmEntry, ...]:
        if len(robots) != 2:
            raise ValueError(f"{len(robots)} robots: two are needed")
        for each in robots:
            if {"/", "\\", ":"} & {*each.name} or f"{each.name}.json".casefold() == PAIR_FILE:
                raise ValueError(
                    f"name {each.name!r}: files of the arm are called so: / \\ : are not allowed,"
                    f" and beside them is {PAIR_FILE}"
                )
        # Two of three operating systems take ``Left.json`` for ``left.json``.
        if robots[0].name.casefold() == robots[1].name.casefold():
            raise ValueError(f"both robots are named {robots[0].name!r}")
        return robots

    @field_validator("base_transform")
    @classmethod
    def _apart(cls, pose: Pose) -> Pose:
        apart = float(np.linalg.norm(pose.T[:3, 3]))
        if not apart >= _LEAST_APART:
            raise ValueError(
                f"the bases are {1e3 * apart:.0f} mm apart: at least {1e3 * _LEAST_APART:.0f} mm"
                " is needed (xyz is the second base in the frame of the first)"
            )
        return pose


@brief_repr
@dataclass(frozen=True, eq=False)
class PairCell:
    """Two robots before each other. Make one with `load_pair_cell`."""

    path: Path
    file: PairCellFile
    robots: tuple[Robot, Robot]
    """Each from its base to its tcp."""

    @property
    def name(self) -> str:
        """Name that the file gives the cell, else the name of its folder."""
        return self.file.name or self.path.resolve().parent.name

    @property
    def arms(self) -> tuple[str, str]:
        """Names of the arms."""
        first, second = self.file.robots
        return first.name, second.name

    @property
    def T_first_second(self) -> FloatArray:
        """Base of the second robot in that of the first, shape (4, 4)."""
        return self.file.base_transform.T

    @property
    def contact(self) -> Contact:
        """What is known of the contact of the two tips."""
        return self.file.contact.contact

    def models(self) -> Mapping[str, Path]:
        """Return the model files of arms that are calibrated already, by the arm's name."""
        named = ((each.name, each.model) for each in self.file.robots)
        return {name: self.path.parent / model for name, model in named if model is not None}


def is_pair_cell(data: object) -> bool:
    """Return whether the contents of a cell file are those of two robots."""
    return isinstance(data, Mapping) and "robots" in data


def load_pair_cell(path: Path) -> PairCell:
    """Return the cell of two robots that a file describes.

    Parameters
    ----------
    path : Path
        YAML with the schema ``elastocal.cell/1`` and the key ``robots``.

    Raises
    ------
    SchemaError
        If the file does not fit: no base transform, an unknown key, a missing unit.
    FileAccessError
        If the file, or one that it names, cannot be read.
    """
    path = Path(path)
    data = parse_yaml(read_text(path), path)
    if not is_pair_cell(data):
        raise SchemaError(f"{path} has no key 'robots': it is not a cell of two robots")
    file = from_data(PairCellFile, data, str(path), SCHEMA)
    first, second = (_robot(path, number, entry) for number, entry in enumerate(file.robots))
    for name, entry in zip((each.name for each in file.robots), file.robots, strict=True):
        if entry.model is not None and not (path.parent / entry.model).is_file():
            raise SchemaError(f"{path}: robots {name!r}: there is no model {entry.model!r}")
    return PairCell(path, file, (first, second))


def write_pair_example(path: str | PathLike[str]) -> Path:
    """Write the cell file of two KR 210 that face each other, and return its place.

    Raises
    ------
    FileAccessError
        If it cannot be written.
    """
    text = (files(__package__) / "example.yaml").read_text(encoding="utf-8")
    write_text(Path(path), text)
    return Path(path)


def _robot(path: Path, number: int, entry: ArmEntry) -> Robot:
    """Return a robot up to its tcp, with gravity as its base stands."""
    try:
        robot = mounted_robot(path, entry.robot, entry.tcp)
    except ElastocalError as error:
        raise SchemaError(f"{path}: robots.{number}: {error}") from error
    gravity = entry.robot.tilted_gravity
    return robot if gravity is None else replace(robot, gravity=gravity)
