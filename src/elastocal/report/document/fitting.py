"""Whether the parts of a report belong together."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from elastocal.cell import fingerprint
from elastocal.codec import CodecData
from elastocal.compensation.conditioning import ToolResult
from elastocal.compensation.process import SimulatedProcess
from elastocal.dataset import Dataset
from elastocal.errors import CodecError, CompensationError, IdentificationError
from elastocal.identification import CalibratedModel
from elastocal.report.document.origins import origin_doubts
from elastocal.report.document.parts import Parts
from elastocal.robot import parse_urdf

_SAME_PLACE = 20e-3
"""Largest distance of contact points, loaded and unloaded, that are one pose, in m."""


def check_model(model: CalibratedModel, dataset: Dataset | None, path: Path) -> None:
    """Refuse a model whose robot has other joints than the dataset.

    Raises
    ------
    IdentificationError
        By the names of the joints.
    """
    names = model.model.robot.joint_names
    if dataset is not None and sorted(names) != sorted(dataset.joint_names):
        raise IdentificationError(
            f"{path} is a model of {model.model.robot.name} with joints {', '.join(names)}; the"
            f" dataset has {', '.join(dataset.joint_names)}"
        )


def check_tool(record: ToolResult, parts: Parts, path: Path) -> ToolResult:
    """Return a tool file, or refuse one whose flange the robot does not have.

    Raises
    ------
    CompensationError
        By the name of the link.
    """
    if parts.cell is not None:
        robot = parts.cell.robot
        links = [str(link.get("name")) for link in parse_urdf(robot.urdf).findall("link")]
        if record.flange not in links:
            raise CompensationError(
                f"{path}: flange {record.flange!r} is no link of {robot.name}: it is the tool of"
                " another robot"
            )
    return record


def check_codec(data: CodecData, parts: Parts, path: Path) -> CodecData:
    """Return a codec, or refuse one of another robot or of other poses.

    Raises
    ------
    CodecError
        By the robot or the number of poses.
    """
    if parts.robot and data.robot and data.robot != parts.robot:
        raise CodecError(f"{path} is a codec of {data.robot}, not of {parts.robot}")
    if parts.dataset is None:
        return data
    known = set(parts.dataset.poses)
    foreign = [label for group in data.pose_labels for label in group if label not in known]
    if foreign:
        raise CodecError(f"{path} has pose {foreign[0]}, which the dataset does not have")
    if not _same_places(data, parts.dataset):
        raise CodecError(f"{path} has its poses at other places than the dataset")
    return data


def check_process(record: SimulatedProcess, parts: Parts, path: Path) -> SimulatedProcess:
    """Return a process, or refuse one of another cell.

    Raises
    ------
    CompensationError
        By the names of the cells.
    """
    if parts.cell is not None and record.table.cell != parts.cell.name:
        raise CompensationError(
            f"{path} is of cell {record.table.cell!r}, the run of cell {parts.cell.name!r}"
        )
    return record


def doubts(parts: Parts) -> tuple[str, ...]:
    """Return what does not fit together although each part by itself is sound."""
    return tuple(_doubts(parts))


def _doubts(parts: Parts) -> Iterator[str]:
    cell, plan, dataset = parts.cell, parts.plan, parts.dataset
    if cell is not None and plan is not None and fingerprint(cell) != plan.cell.fingerprint:
        yield "the plan was made for another state of the cell file: its fingerprint differs"
    if parts.again is not None and not parts.again.same:
        yield (
            "the calibration made again from the dataset does not give the figures of the model"
            " file: the model is of other data or other settings"
        )
    yield from origin_doubts(parts)
    if plan is not None and dataset is not None:
        planned = {pose.id for pose in plan.poses}
        foreign = sorted(set(dataset.poses) - planned)
        if foreign:
            yield f"the dataset has pose {foreign[0]}, which the plan does not have"


def _same_places(data: CodecData, dataset: Dataset) -> bool:
    if dataset.tcp_position is None:
        return True
    place = dict(zip(dataset.poses, dataset.tcp_position, strict=True))
    found = np.array([place[group[0]] for group in data.pose_labels])
    gap = np.linalg.norm(found - data.contact, axis=1)
    return bool(np.all(~(gap > _SAME_PLACE)))
