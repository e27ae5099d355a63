"""Merging: several datasets of one robot become one."""

import math
from collections.abc import Sequence

import numpy as np

from elastocal.dataset._layout import MISSING, FloatArray
from elastocal.dataset.dataset import Dataset
from elastocal.errors import DatasetError

_SAME_ATTRIBUTES = ("robot_name", "robot_urdf", "tcp_frame")

_SAME_MARKER = 1e-3
"""Markers that are estimated closer to one another are the same, in m: the displacements of a
tool that turns by 1 mrad under load then differ by 1 µm."""


def merge(datasets: Sequence[Dataset], *, relabel: bool = False) -> Dataset:
    """Return all poses of several datasets of the same robot.

    Poses keep their labels, and one that stands in two datasets is refused: whether it is the
    same pose measured again or another one is for the user to say. Load cases are the union, in
    order of first appearance; a pose that lacks one has NaN and the status missing there. Joints
    are matched by name. Provenances are joined with ``"; "``; the marker is the first one's.

    Parameters
    ----------
    datasets : sequence of Dataset
        At least one.
    relabel : bool
        Number the poses 0, 1, 2 … instead, for campaigns that each count from zero.

    Raises
    ------
    DatasetError
        If robots, joints or optional variables differ, or a pose label repeats.
    """
    if not datasets:
        raise DatasetError("nothing to merge: give at least one dataset")
    for index, dataset in enumerate(datasets[1:], start=1):
        _check_compatible(datasets[0], dataset, index)
    if not relabel:
        _check_poses_differ(datasets)
    cases = tuple(dict.fromkeys(case for dataset in datasets for case in dataset.load_cases))
    poses = tuple(pose for dataset in datasets for pose in dataset.poses)
    sources = [dataset.provenance for dataset in datasets if dataset.provenance]
    provenance = "; ".join(dict.fromkeys(sources))
    return Dataset(
        poses=tuple(range(len(poses))) if relabel else poses,
        load_cases=cases,
        joint_names=datasets[0].joint_names,
        joint_units=datasets[0].joint_units,
        status=np.concatenate([_spread(each, each.status, cases, MISSING) for each in datasets]),
        attributes={**datasets[0].attributes, "provenance": provenance},
        **{name: _joined(datasets, name, cases) for name in datasets[0].arrays},
    )


def _joined(datasets: Sequence[Dataset], name: str, cases: Sequence[str]) -> FloatArray:
    """Return the values of a variable at the poses of all datasets, joints in the first's order."""
    parts = []
    for dataset in datasets:
        values = dataset.arrays[name]
        if name == "joint_position":
            order = [dataset.joint_names.index(joint) for joint in datasets[0].joint_names]
            values = values[..., order]
        parts.append(values if name == "tcp_position" else _spread(dataset, values, cases, np.nan))
    return np.concatenate(parts)


def _spread(dataset: Dataset, values: np.ndarray, cases: Sequence[str], fill: float) -> np.ndarray:
    """Return values of shape (pose, load_case, …) for other load cases; ``fill`` without one."""
    shape = (len(values), len(cases), *values.shape[2:])
    spread = np.full(shape, fill, dtype=values.dtype)
    spread[:, [cases.index(case) for case in dataset.load_cases]] = values
    return spread


def _check_compatible(first: Dataset, other: Dataset, index: int) -> None:
    """Refuse to merge dataset ``index`` with dataset 0 when they are not of one kind."""
    for name in _SAME_ATTRIBUTES:
        here, there = first.attributes.get(name), other.attributes.get(name)
        if here != there:
            raise DatasetError(
                f"datasets 0 and {index} are not of the same robot: attribute {name!r} is"
                f" {_short(here)} in one and {_short(there)} in the other"
            )
    _check_marker(first, other, index)
    joints = [dict(zip(data.joint_names, data.joint_units, strict=True)) for data in (first, other)]
    if joints[0] != joints[1]:
        raise DatasetError(
            f"datasets 0 and {index} have different joints: {joints[0]} and {joints[1]}"
        )
    for variable in sorted(set(first.arrays) ^ set(other.arrays)):
        lacking = index if variable in first.arrays else 0
        raise DatasetError(
            f"dataset {lacking} has no variable {variable!r}, dataset {index - lacking} has:"
            " what was not measured cannot be filled in"
        )


def _check_marker(first: Dataset, other: Dataset, index: int) -> None:
    here, there = first.marker, other.marker
    if here is None and there is None:
        return
    if here is None or there is None or not math.dist(here, there) <= _SAME_MARKER:
        raise DatasetError(
            f"datasets 0 and {index} have different markers: attribute 'marker' is"
            f" {_short(first.attributes.get('marker'))} in one and"
            f" {_short(other.attributes.get('marker'))} in the other"
        )


def _check_poses_differ(datasets: Sequence[Dataset]) -> None:
    first: dict[int, int] = {}
    for index, dataset in enumerate(datasets):
        for pose in dataset.poses:
            if pose in first:
                raise DatasetError(
                    f"pose {pose} is in datasets {first[pose]} and {index}: give every pose its"
                    " own label, or number the poses anew with relabel=True"
                )
            first[pose] = index


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 40 else f"{text[:36]}…'"
