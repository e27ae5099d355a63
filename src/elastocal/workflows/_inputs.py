"""Inputs that several workflows share: robot, postures and frames in the form of options.

The module also checks that a model fits the cell, and its coverage.
"""

import contextlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.dataset import Dataset, read, require_joint_names
from elastocal.errors import (
    CompensationError,
    DatasetError,
    ElastocalError,
    GeometryError,
    RobotError,
    UnitError,
)
from elastocal.identification import (
    MOST_UNEXPLAINED,
    CalibratedModel,
    Contact,
    ModelSource,
    attainable_rank,
    describe_briefly,
    read_contact,
    read_model,
    unseen_groups,
)
from elastocal.options import Option
from elastocal.robot import (
    Robot,
    T_from_xyzabc,
    catalogue,
    of_one_arm,
    parse_urdf,
    read_urdf,
    refusals_naming,
    same_joints,
    tcp_gap,
    tip_links,
    tool_link,
    with_tool,
)
from elastocal.units import parse_number, parse_point, parse_quantity, quantity
from elastocal.wording import listed

if TYPE_CHECKING:
    from elastocal.compensation import ArmGrowth
    from elastocal.compensation.kernel import BuiltArm
    from elastocal.geometry import AngleCheck, GeometryModel, Payload

_LONGEST_TOOL = 10.0
"""In m: no tool of a robot is longer; a longer one was meant in mm."""
ROBOT_SUFFIXES: tuple[str, ...] = (".urdf", ".xml", ".xacro", ".srdf")
"""Names of robot descriptions; a template of xacro is refused with the command that expands it, an
SRDF as what it is."""
_TOOL_LINK = "tcp"
"""Name of the link that a tool given by numbers gets."""
_NOT_COVERED = (
    "the calibration saw fewer combinations of springs than a force can load: predictions away from"
    " its poses are not covered by the intervals"
)
_TOOL_ALONE = (
    "{gap}: gears were calibrated as if the arm weighed nothing, and the new tool's mass now"
    " preloads them alone"
)
_TOOL_LOADS = (
    "forces at this tool load what the calibration did not see: {names}; its share is missing from"
    " predictions and their intervals"
)


def find_robot(
    robot: str | Robot | None, tcp: str | None, tool: str | None, dataset: Dataset | None = None
) -> Robot:
    """Return the robot that a user means.

    Parameters
    ----------
    robot : str, Robot or None
        A URDF file, a catalogue name, the robot itself, or None for the dataset's own.
    tcp : str or None
        Link at the tool centre point; by default that of the robot itself or of the dataset, or
        the only tip (`elastocal.robot.tip_links`).
    tool : str or None
        Pose of the tcp behind that link, ``"x, y, z, a, b, c"`` with units (KUKA Z-Y'-X'').
    dataset : Dataset, optional
        A dataset that may name both, and say where gravity points if the base is not upright.

    Raises
    ------
    RobotError
        If there is no robot, or its tool centre point is undetermined.
    """
    T_tcp_tool = None if tool is None else parse_frame(tool, "tool", error=RobotError)
    if isinstance(robot, Robot):
        arm = _robot_at(robot.urdf, tcp or robot.tip, T_tcp_tool, robot.base)
        arm = replace(arm, meshes=robot.meshes, gravity=robot.gravity)
    else:
        urdf, path = _find_urdf(robot, dataset)
        if robot is None and dataset is not None:
            tcp = tcp or dataset.tcp_frame
        with contextlib.nullcontext() if path is None else refusals_naming(path):
            arm = _robot_at(urdf, tcp, T_tcp_tool)
    if dataset is None or dataset.gravity is None:
        return arm
    return replace(arm, gravity=dataset.gravity)


def require_same_robot(model: Robot, cell: Robot, names: tuple[str, str]) -> None:
    """Refuse a model whose robot, or whose tool centre point, is not that of the cell.

    Parameters
    ----------
    model, cell : Robot
        The robots of a calibrated model and of a cell.
    names : tuple of str
        File of the model and name of the cell, for the message.

    Raises
    ------
    RobotError
        If joints have other names, or the same joints lead elsewhere.
    """
    file, name = names
    if not same_joints(model, cell):
        raise RobotError(
            f"{file}: the model's robot has the joints {', '.join(model.joint_names)}, that of"
            f" cell {name} {', '.join(cell.joint_names)}: they must be the same"
        )
    gap = tcp_gap(model, cell)
    if not of_one_arm(gap, model, cell):
        raise RobotError(
            f"{file}: the same joints lead {quantity(gap.angle, '°', '.3g')} and"
            f" {quantity(gap.distance, 'mm', '.3g')} apart in the model and in cell {name}:"
            " another tool centre point, base or robot"
        )


DatasetSource = str | PathLike[str] | Dataset | Sequence[str | PathLike[str] | Dataset]
"""A dataset, the file that holds it, the folder of a run, or several of them."""


KnownContact = Annotated[
    Path | Contact | None,
    Option(metavar="CONTACT.yaml", help="What is known of the contact, without a tracker."),
]
"""What is known of the contact that holds the tool where no tracker measured, or its file."""


def known_contact(contact: Path | Contact | None) -> Contact | None:
    """Return what is known of a contact; None: nothing is stated.

    Raises
    ------
    SchemaError, FileAccessError
        If its file cannot be read or does not fit.
    """
    if contact is None or isinstance(contact, Contact):
        return contact
    return read_contact(Path(contact))


def dataset_files(source: DatasetSource) -> tuple[Path, ...]:
    """Return the files of those datasets that are in files."""
    return tuple(_file(Path(each)) for each in _each(source) if not isinstance(each, Dataset))


def read_datasets(source: DatasetSource) -> list[tuple[Path, Dataset]]:
    """Return datasets with their files; one that is given has the name of its place.

    Raises
    ------
    DatasetError, SchemaError
        If a file holds no dataset, or a folder is no run that has one.
    FileAccessError
        If it cannot be read.
    """
    return [
        (Path(f"dataset {number}"), each)
        if isinstance(each, Dataset)
        else (file := _file(Path(each)), read(file))
        for number, each in enumerate(_each(source), start=1)
    ]


def _file(path: Path) -> Path:
    """Return the file of a dataset: that of a run, where its folder is given."""
    if not path.is_dir():
        return path
    from elastocal.procedure import RunFolder  # its import takes longer than a calibration

    run = RunFolder(path)
    if not run.journal.is_file():
        raise DatasetError(
            f"{path}: the folder is no run: allowed are a dataset (.nc, .csv) and the folder of a"
            " run"
        )
    if not run.dataset.is_file():
        raise DatasetError(
            f"{path}: the run has no dataset: `elastocal derive {path}` makes it of its record"
        )
    return run.dataset


def _each(source: DatasetSource) -> tuple[str | PathLike[str] | Dataset, ...]:
    return (source,) if isinstance(source, str | PathLike | Dataset) else tuple(source)


@dataclass(frozen=True, kw_only=True)
class NewTool:
    """Settings of every command that may work at another tool than the one calibrated with."""

    tool_frame: Annotated[str | None, Option("--tool")] = None
    """New tcp in the calibrated tcp's frame, ``"x, y, z, a, b, c"`` with units (Z-Y'-X''); none:
    the calibrated tool."""
    tool_mass: str | None = None
    """Mass of the new tool with its unit; none: that of the calibrated one. It changes sag and
    the preload of gears."""
    tool_centre: str | None = None
    """Centre of that mass in the new tcp's frame, ``"x, y, z"`` with units."""

    def read_model(self, source: ModelSource) -> CalibratedModel:
        """Return the calibrated model of a file, at the tool that is meant.

        Raises
        ------
        RobotError, UnitError
            If the new tool is not understood.
        SchemaError, FileAccessError
            If the file is not a model, or cannot be read.
        """
        calibrated = read_model(source)
        if self.tool_frame is None:
            if self.tool_mass is not None or self.tool_centre is not None:
                raise RobotError("a tool's mass needs its tcp: give --tool 'x, y, z, a, b, c'")
            return calibrated
        T_tcp_tool = parse_frame(self.tool_frame, "tool", error=RobotError)
        mass = None if self.tool_mass is None else parse_quantity(self.tool_mass, "mass")
        centre = None if self.tool_centre is None else parse_point(self.tool_centre)
        _require_near("tcp", T_tcp_tool[:3, 3], "the calibrated one")
        if centre is not None:
            _require_near("centre of mass", centre, "its tcp")
        return calibrated.with_tool(T_tcp_tool, mass, centre)


@dataclass(frozen=True)
class UnloadedArm:
    """An arm without process force, as its controller knows it and as it stands."""

    controller: Robot
    """The model's own arm where its geometry is unknown."""
    tool: Callable[[FloatArray], FloatArray] | None = None
    """From joints, shape (row, joint), to the true position of the tool in base, shape (row, 3), in
    m; None where its geometry is unknown."""
    angles: "AngleCheck | None" = None
    """Is told the rows that are worked at; see `AngleCheck.findings`."""

    @property
    def notes(self) -> tuple[str, ...]:
        """What a person should know of the rows so far."""
        return () if self.angles is None else tuple(map(str, self.angles.findings()))


@dataclass(frozen=True, kw_only=True)
class ArmAsBuilt:
    """Settings of every command that may use the true position of the unloaded arm."""

    geometry: Path | None = None
    """Model file of `geometry` of the same arm: its errors and sag are corrected too."""
    payload: str | None = None
    """Mass of the tool beyond the description in that model, with its unit."""
    payload_centre: str | None = None
    """Its centre in that model's tcp, ``"x, y, z"`` with units."""

    def unloaded(self, robot: Robot) -> "UnloadedArm":
        """Return the arm without process force.

        Raises
        ------
        GeometryError
            If the geometry is of another arm, or a payload has none.
        UnitError
            If a unit is missing or wrong.
        """
        known = self._geometry()
        if known is None:
            return UnloadedArm(robot)
        from elastocal.geometry import AngleCheck

        found, payload = known
        # Refuses another arm first.
        drawn, tool = found.as_drawn(robot), found.tool_of(robot, payload)
        return UnloadedArm(drawn, tool, AngleCheck(found.functions, robot.joint_names))

    def built(self, robot: Robot) -> "BuiltArm | None":
        """Return the arm as it was built, for a program of its errors; None: it is unknown.

        Raises
        ------
        GeometryError, UnitError
            As for `unloaded`.
        """
        known = self._geometry()
        if known is None:
            return None
        from elastocal.compensation.kernel import BuiltArm

        found, payload = known
        errors, tools = found.errors, found.tools(robot)
        return BuiltArm(
            found.weighed,
            *(errors.place, errors.motion, errors.bend),
            None if found.sag is None else errors.sag,
            *tools,
            *(payload.mass, payload.centre),
        )

    def _geometry(self) -> "tuple[GeometryModel, Payload] | None":
        if self.geometry is None:
            if self.payload is not None or self.payload_centre is not None:
                raise GeometryError("a payload needs the arm that it bends: give --geometry")
            return None
        from elastocal.geometry import Payload, read_geometry

        mass = 0.0 if self.payload is None else parse_quantity(self.payload, "mass")
        x, y, z = (0.0,) * 3 if self.payload_centre is None else parse_point(self.payload_centre)
        return read_geometry(self.geometry), Payload(mass, (x, y, z))


@dataclass(frozen=True, kw_only=True)
class TouchedArm:
    """Settings of every command that may know how far the arm has grown."""

    arm_state: Annotated[Path | None, Option(metavar="STATE.json")] = None
    """State of the arm by `touch`: its growth is corrected too."""

    def growth(self, robot: Robot) -> "ArmGrowth | None":
        """Return how far the arm has grown; None where nobody has touched.

        Raises
        ------
        CompensationError
            If the state is of another arm.
        SchemaError, FileAccessError
            If the file is no state, was changed by hand, or cannot be read.
        """
        if self.arm_state is None:
            return None
        # Most commands with inputs correct nothing.
        from elastocal.compensation import read_arm_growth

        return read_arm_growth(self.arm_state, robot)


def growth_notes(state: "ArmGrowth | None") -> tuple[str, ...]:
    """Return what a person should know of a correction that counts a state in."""
    return () if state is None else state.notes(datetime.now(UTC))


def _require_near(what: str, point: ArrayLike, origin: str) -> None:
    """Refuse a point of a tool that lies farther off than tools are long.

    Raises
    ------
    RobotError
        If it does.
    """
    distance = float(np.linalg.norm(point))
    if not distance <= _LONGEST_TOOL:
        raise RobotError(
            f"the tool's {what} lies {distance:.4g} m from {origin}: at most {_LONGEST_TOOL:g} m"
            " are allowed"
        )


def require_model_of_arm(calibrated: CalibratedModel, name: str) -> None:
    """Refuse a model that leaves too much unexplained for an arm to be corrected by it.

    Raises
    ------
    CompensationError
        With how much, or that the model does not say.
    """
    if math.isnan(calibrated.unexplained):
        raise CompensationError(
            f"{name} does not say how much of the deflection it leaves unexplained at left-out"
            " poses: calibrate again"
        )
    if not calibrated.unexplained <= MOST_UNEXPLAINED:
        raise CompensationError(
            f"{name} leaves {calibrated.unexplained:.0%} of the deflection unexplained at left-out"
            f" poses, at most {MOST_UNEXPLAINED:.0%} is allowed: it is no model of this arm"
        )


def coverage_notes(calibrated: CalibratedModel) -> tuple[str, ...]:
    """Return a warning unless every combination that forces can load was determined."""
    if calibrated.tool is not None:
        seen, before = calibrated.observability, calibrated.calibrated_model
        unseen = unseen_groups(calibrated.model, seen, before)
        names = ", ".join(map(describe_briefly, unseen))
        notes = (_TOOL_LOADS.format(names=names),) if unseen else ()
        gap = calibrated.model.robot.chain.weight_gap
        alone = calibrated.tool.mass is not None and calibrated.model.bears_weight and gap
        return (*notes, _TOOL_ALONE.format(gap=gap)) if alone else notes
    covered = calibrated.observability.rank >= attainable_rank(calibrated.model)
    return () if covered else (_NOT_COVERED,)


def parse_posture(robot: Robot, text: str | None) -> FloatArray | None:
    """Return joint positions, shape (joint,), in rad or m; None for no text.

    Raises
    ------
    RobotError
        If there is not one quantity a joint, or one is outside its limits.
    UnitError
        If a unit is missing or wrong.
    """
    if text is None:
        return None
    parts, names = [part.strip() for part in text.split(",")], robot.joint_names
    if len(parts) != len(names):
        raise RobotError(
            f"posture {text!r} has {len(parts)} values: it must have one a joint of {robot.name}"
            f" ({', '.join(names)})"
        )
    kinds = ["angle" if turns else "length" for turns in robot.revolute]
    q = np.array([parse_quantity(part, kind) for part, kind in zip(parts, kinds, strict=True)])
    outside = ~(robot.limits.margin(q) >= 0.0)
    if outside.any():
        joint = int(np.argmax(outside))
        raise RobotError(
            f"posture {text!r}: {names[joint]} at {parts[joint]} is outside its limits"
        )
    return q


def write_posture(robot: Robot, q: Sequence[float]) -> str:
    """Return a posture as `parse_posture` reads it, to 0.1 deg and 0.1 mm."""
    return ", ".join(
        quantity(value, "deg", ".1f") if turns else quantity(value, "mm", ".1f")
        for value, turns in zip(q, robot.revolute, strict=True)
    )


def parse_frame(
    text: str,
    name: str = "frame",
    rule: str = "must be six quantities, e.g. '0 mm, 0 mm, 565 mm, 0 deg, 0 deg, 0 deg'",
    error: type[ElastocalError] = UnitError,
) -> FloatArray:
    """Return a frame, shape (4, 4), from ``"x, y, z, a, b, c"`` (KUKA Z-Y'-X'').

    Parameters
    ----------
    text : str
        Three lengths and three angles.
    name, rule : str
        For the refusal of another number of quantities.
    error : type
        What that refusal is raised as.

    Raises
    ------
    UnitError
        If a unit is missing or wrong.
    """
    parts = [part.strip() for part in text.split(",")]
    if len(parts) != 6:
        raise error(f"{name} {text!r} {rule}")
    kinds = ("length",) * 3 + ("angle",) * 3
    try:
        numbers = [parse_quantity(p, kind) for p, kind in zip(parts, kinds, strict=True)]
    except UnitError as refused:
        raise UnitError(f"{name} {text!r}: {refused}") from refused
    return T_from_xyzabc(*numbers)


def _robot_at(
    urdf: str, tcp: str | None, T_tcp_tool: FloatArray | None, base: str | None = None
) -> Robot:
    """Return the robot of a URDF up to a link, its only tip by default, or to a tool behind it."""
    if not tcp:
        tips = list(tip_links(parse_urdf(urdf)))
        if len(tips) != 1:
            straight = Robot.from_urdf(urdf, tool_link(urdf)).chain
            raise RobotError(
                f"name the tool centre point with --tcp: {listed(tips)}; z of {straight.tip!r}"
                f" points {straight.tip_direction}"
            )
        tcp = tips[0]
    if T_tcp_tool is not None:
        urdf, tcp = with_tool(urdf, tcp, _TOOL_LINK, T_tcp_tool), _TOOL_LINK
    robot = Robot.from_urdf(urdf, tcp, base)
    require_joint_names(robot.joint_names)
    return robot


def _find_urdf(robot: str | None, dataset: Dataset | None) -> tuple[str, Path | None]:
    """Return the URDF text that is meant, and its file where it has one."""
    if robot is None:
        if dataset is None or not dataset.robot_urdf:
            raise RobotError(
                "the dataset names no robot: give --robot with a URDF file or a catalogue name"
                " (see `elastocal robots`)"
            )
        return dataset.robot_urdf, None
    path = Path(robot)
    if path.suffix.lower() in ROBOT_SUFFIXES or is_file(path):
        return read_urdf(path), path
    return catalogue.urdf(robot), None


def is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # a name that is too long for a file
        return False


def seconds_of(duration: str | float | None) -> float:
    """Return a duration in s; a bare number is in s, None is unlimited.

    Raises
    ------
    UnitError
        If it is not above 0.
    """
    if duration is None:
        return float("inf")
    try:
        found = parse_number(str(duration))
    except ValueError:
        found = parse_quantity(duration, "time")
    if not 0.0 < found < float("inf"):
        raise UnitError(f"duration {duration!r} must be a time above 0, such as '60 s'")
    return found
