"""Merging: several datasets of one robot become one."""

import math
from collections.abc import Sequence

import numpy as np
import xarray as xr

from elastocal.dataset.dataset import Dataset
from elastocal.dataset.layout import MISSING
from elastocal.errors import DatasetError

_SAME_ATTRIBUTES = ("robot_name", "robot_urdf", "tcp_frame")

SAME_MARKER = 1e-3
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
    cases = list(dict.fromkeys(case for dataset in datasets for case in dataset.load_cases))
    joints = datasets[0].joint_names
    parts = [
        dataset.data.isel(joint=[dataset.joint_names.index(name) for name in joints]).reindex(
            load_case=cases, fill_value={"status": np.int8(MISSING)}
        )
        for dataset in datasets
    ]
    # compat decides about joint_unit, which is the same in all parts by now.
    data = xr.concat(
        parts,
        "pose",
        data_vars="minimal",
        coords="minimal",
        compat="override",
        join="exact",
        combine_attrs="override",
    )
    sources = [dataset.provenance for dataset in datasets if dataset.provenance]
    data.attrs["provenance"] = "; ".join(dict.fromkeys(sources))
    if relabel:
        data = data.assign_coords(pose=np.arange(data.sizes["pose"]))
    return Dataset(data)


def _check_compatible(first: Dataset, other: Dataset, index: int) -> None:
    """Refuse to merge dataset ``index`` with dataset 0 when they are not of one kind."""
    for name in _SAME_ATTRIBUTES:
        here, there = first.data.attrs.get(name), other.data.attrs.get(name)
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
    for variable in sorted(set(first.data.data_vars) ^ set(other.data.data_vars), key=str):
        lacking = index if variable in first.data else 0
        raise DatasetError(
            f"dataset {lacking} has no variable {variable!r}, dataset {index - lacking} has:"
            " what was not measured cannot be filled in"
        )


def _check_marker(first: Dataset, other: Dataset, index: int) -> None:
    here, there = first.marker, other.marker
    if here is None and there is None:
        return
    if here is None or there is None or not math.dist(here, there) <= SAME_MARKER:
        raise DatasetError(
            f"datasets 0 and {index} have different markers: attribute 'marker' is"
            f" {_short(first.data.attrs.get('marker'))} in one and"
            f" {_short(other.data.attrs.get('marker'))} in the other"
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
