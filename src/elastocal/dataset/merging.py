"""Parts and wholes: readings or some poses of a dataset, several datasets of one robot as one."""

import math
from collections.abc import Hashable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from elastocal.dataset._layout import (
    CONTACTS,
    INTEGERS,
    MADE_FROM,
    MARKER_POSITION,
    MISSING,
    SEQUENCE,
    STATIONS,
    VARIABLES,
    FloatArray,
    IntArray,
    StatusArray,
    write_doubts,
)
from elastocal.dataset.readings import Presses, Readings
from elastocal.errors import DatasetError, nearest

if TYPE_CHECKING:
    from elastocal.dataset.dataset import Dataset

_SAME_ATTRIBUTES = ("robot_name", "robot_urdf", "tcp_frame", "gravity")

_SAME_MARKER = 1e-3
"""Markers that are estimated closer to one another are the same, in m: the displacements of a
tool that turns by 1 mrad under load then differ by 1 µm."""


def merge(
    datasets: Sequence["Dataset"],
    *,
    relabel: bool = False,
    campaigns: Sequence[str] | None = None,
) -> "Dataset":
    """Return all poses of several datasets of the same robot.

    Poses keep their labels, and one that is in two datasets is refused: the user must state whether
    it is the same pose. Load cases are the union, in order of first appearance; a pose that lacks
    one has NaN and the status missing there. Joints are matched by name. Provenances are joined
    with ``"; "``; the marker is the first one's. Readings keep their order in time, and a reference
    without a recorded force was unloaded.

    Parameters
    ----------
    datasets : sequence of Dataset
        At least one.
    relabel : bool
        Number the poses 0, 1, 2 … instead, for campaigns that each count from zero.
    campaigns : sequence of str, optional
        Name of the campaign that each dataset is. By default those that the datasets name; one
        that names none, beside others that do, is called by its number.

    Raises
    ------
    DatasetError
        If robots, joints, optional variables or histories differ, or a pose label repeats.
    """
    if not datasets:
        raise DatasetError("nothing to merge: give at least one dataset")
    for index, dataset in enumerate(datasets[1:], start=1):
        _check_compatible(datasets[0], dataset, index)
    if not relabel:
        _check_poses_differ(datasets)
    cases = tuple(dict.fromkeys(case for dataset in datasets for case in dataset.load_cases))
    poses = tuple(pose for dataset in datasets for pose in dataset.poses)
    present = dict.fromkeys(name for dataset in datasets for name in dataset.arrays)
    # Stations of different campaigns are different ones, though their names may be the same.
    dropped = _OF_ONE_CAMPAIGN if len(datasets) > 1 else ()
    names = [name for name in present if name not in dropped]
    joined: dict[str, np.ndarray] = {name: _joined(datasets, name, cases) for name in names}
    first = replace(datasets[0], marker_position=None) if dropped else datasets[0]
    sources = [dataset.provenance for dataset in datasets if dataset.provenance]
    provenance = "; ".join(dict.fromkeys(sources))
    # What the first was made from, the others were not.
    own = datasets[0].attributes.items()
    stated = {name: each for name, each in own if name != MADE_FROM and name not in dropped}
    return replace(
        first,
        # Said again for the type checker: the arrays by name are none of these.
        joint_names=first.joint_names,
        joint_units=first.joint_units,
        poses=tuple(range(len(poses))) if relabel else poses,
        load_cases=cases,
        status=np.concatenate([_spread(each, each.status, cases, MISSING) for each in datasets]),
        sequence=_sequence(datasets, cases),
        contacts=_contacts(datasets, cases),
        campaigns=_campaigns(datasets, campaigns),
        attributes={
            **stated,
            **_check(datasets),
            **write_doubts(doubt for each in datasets for doubt in each.doubts),
            "provenance": provenance,
        },
        **joined,
    )


def _check(datasets: Sequence["Dataset"]) -> dict[str, str]:
    """Return the attribute of the load cases that any of the datasets keeps out of every fit."""
    kept_out = dict.fromkeys(case for dataset in datasets for case in dataset.check_cases)
    return {"check": ", ".join(kept_out)} if kept_out else {}


def _sequence(datasets: Sequence["Dataset"], cases: Sequence[str]) -> IntArray | None:
    """Return the order in time; None where it is the order of the load cases at all poses."""
    places = [[cases.index(case) for case in dataset.load_cases] for dataset in datasets]
    ordered = all(place == sorted(place) for place in places)
    if ordered and all(dataset.sequence is None for dataset in datasets):
        return None
    return np.concatenate([_spread(each, each.order, cases, -1) for each in datasets])


def _contacts(datasets: Sequence["Dataset"], cases: Sequence[str]) -> StatusArray | None:
    """Return the disks stacked at each press; None where none of the datasets states them."""
    if all(dataset.contacts is None for dataset in datasets):
        return None
    parts = []
    for dataset in datasets:
        one = np.ones_like(dataset.status)
        own = one if dataset.contacts is None else dataset.contacts
        parts.append(_spread(dataset, own, cases, 1))
    return np.concatenate(parts)


def _campaigns(datasets: Sequence["Dataset"], named: Sequence[str] | None) -> tuple[str, ...]:
    if named is None and not any(dataset.campaigns for dataset in datasets):
        return ()
    if named is not None and len(named) != len(datasets):
        raise DatasetError(f"{len(named)} campaigns are named for {len(datasets)} datasets")
    labels: list[str] = []
    for index, dataset in enumerate(datasets):
        own = dataset.campaigns
        if named is None:
            labels += own or [str(index)] * len(dataset.poses)
        else:
            # Two datasets may each count their campaigns from one.
            labels += [f"{named[index]} {label}" for label in own] or [named[index]] * len(
                dataset.poses
            )
    return tuple(labels)


_DIMS = {variable.name: variable.dims for variable in (*VARIABLES, *INTEGERS)}
_ZERO_BY_DEFAULT = "reference_force"
_UNMEASURED = "marker_displacement"
"""Variable without a number where no tracker measured."""
_OF_ONE_CAMPAIGN = (MARKER_POSITION.name, STATIONS)
"""Fields left out when campaigns are combined."""


def selected(
    dataset: "Dataset", poses: Sequence[int] | None, load_cases: Sequence[str] | None
) -> "Dataset":
    """Return some poses and load cases of a dataset, as `Dataset.select` does."""
    rows = list(range(len(dataset.poses)))
    if poses is not None:
        rows = _positions("pose", poses, dataset.poses)
    columns = list(range(len(dataset.load_cases)))
    if load_cases is not None:
        columns = _positions("load case", load_cases, dataset.load_cases)
    elif dataset.usable[rows].any():
        columns = np.flatnonzero(dataset.usable[rows].any(axis=0)).tolist()
    return _taken(dataset, rows, columns)


def _taken(dataset: "Dataset", rows: Sequence[int], columns: Sequence[int]) -> "Dataset":
    """Return the poses and load cases at some positions."""
    index = np.ix_(rows, columns)
    variables: dict[str, np.ndarray] = dict(dataset.arrays)
    if dataset.sequence is not None or sorted(columns) != list(columns):
        variables[SEQUENCE.name] = dataset.order
    if dataset.contacts is not None:
        variables[CONTACTS.name] = dataset.contacts
    return replace(
        dataset,
        # Said again for the type checker: the arrays by name are none of these.
        joint_names=dataset.joint_names,
        joint_units=dataset.joint_units,
        attributes=dataset.attributes,
        poses=tuple(dataset.poses[row] for row in rows),
        load_cases=tuple(dataset.load_cases[column] for column in columns),
        campaigns=tuple(dataset.campaigns[row] for row in rows) if dataset.campaigns else (),
        status=dataset.status[index],
        **{
            name: values[index] if "load_case" in _DIMS[name] else values[list(rows)]
            for name, values in variables.items()
        },
    )


def usable_readings(
    dataset: "Dataset", joint_names: Sequence[str], *, check: bool = False
) -> Readings:
    """Return the usable readings of a dataset as flat arrays; see `Dataset.readings`."""
    wanted = list(joint_names)
    if sorted(wanted) != sorted(dataset.joint_names):
        raise DatasetError(
            f"joints of the dataset are {list(dataset.joint_names)}, those of the robot {wanted}:"
            " they must have the same names"
        )
    order = [dataset.joint_names.index(name) for name in wanted]
    pose, case = np.nonzero(dataset.usable)
    flat: dict[str, np.ndarray] = {}
    for variable in VARIABLES:
        values = dataset.arrays.get(variable.name)
        if values is not None and variable != MARKER_POSITION:
            rows = values[pose, case] if "load_case" in variable.dims else values[pose]
            flat[variable.name] = rows[:, order] if "joint" in variable.dims else rows
    flat |= _held_by_contact(dataset, pose, case)
    presses = _unusable_presses(dataset, order)
    if dataset.sequence is not None or presses is not None:
        flat["sequence"] = dataset.order[pose, case]
    if dataset.campaigns:
        flat["campaign"] = np.array(dataset.campaigns)[pose]
    readings = Readings(
        np.array(dataset.poses)[pose],
        np.array(dataset.load_cases)[case],
        conditioned=dataset.conditioned,
        also_pressed=presses,
        doubts=dataset.doubts,
        **flat,
    )
    kept_out = np.isin(readings.load_case, dataset.check_cases)
    return readings.set_aside(~kept_out if check else kept_out)


def _held_by_contact(
    dataset: "Dataset", pose: np.ndarray, case: np.ndarray
) -> dict[str, np.ndarray]:
    """Return what differs of readings at poses that no tracker measured; nothing of none."""
    held = np.isin(np.array(dataset.poses)[pose], dataset.poses_unmeasured)
    if not held.any():
        return {}
    stacked = np.ones_like(dataset.status) if dataset.contacts is None else dataset.contacts
    found = {"contacts": np.where(held, stacked[pose, case], 0)}
    marker = np.zeros((len(pose), 3))
    if dataset.marker_displacement is not None:
        marker[~held] = dataset.marker_displacement[pose, case][~held]
        if dataset.marker_sigma is not None:
            # Nothing is weighed by it there; a row needs some number.
            sigma = dataset.marker_sigma[pose, case].copy()
            sigma[held] = np.median(sigma[~held], axis=0)
            found["marker_sigma"] = sigma
    return found | {"marker_displacement": marker}


def _unusable_presses(dataset: "Dataset", order: Sequence[int]) -> Presses | None:
    """Return the known presses on the arm that gave no usable reading; None: there are none."""
    known = np.isfinite(dataset.joint_position).all(axis=2) & np.isfinite(dataset.force).all(axis=2)
    if dataset.moment is not None:
        known &= np.isfinite(dataset.moment).all(axis=2)
    pose, case = np.nonzero(known & ~dataset.usable)
    if not len(pose):
        return None
    return Presses(
        np.array(dataset.poses)[pose],
        dataset.order[pose, case],
        dataset.joint_position[pose, case][:, order],
        dataset.force[pose, case],
        None if dataset.moment is None else dataset.moment[pose, case],
    )


def _positions(kind: str, labels: Sequence[object], known: Sequence[Hashable]) -> list[int]:
    for label in labels:
        if label not in known:
            listed = ", ".join(map(str, known[:20])) + (", …" if len(known) > 20 else "")
            names = [name for name in known if isinstance(name, str)]
            hint = nearest(label, names) if isinstance(label, str) else ""
            raise DatasetError(f"{kind} {label!r} is not in the dataset{hint} (known: {listed})")
    return [known.index(label) for label in labels]


def _joined(datasets: Sequence["Dataset"], name: str, cases: Sequence[str]) -> FloatArray:
    """Return the values of a variable at the poses of all datasets, joints in the first's order."""
    parts = []
    for dataset in datasets:
        values = dataset.arrays.get(name, np.zeros((len(dataset.poses), 3)))
        if name == _UNMEASURED and dataset.marker_displacement is None:
            values = np.full(dataset.force.shape, np.nan)
        if "joint" in _DIMS[name]:
            order = [dataset.joint_names.index(joint) for joint in datasets[0].joint_names]
            values = values[..., order]
        by_case = "load_case" in _DIMS[name]
        parts.append(_spread(dataset, values, cases, np.nan) if by_case else values)
    return np.concatenate(parts)


def _spread(
    dataset: "Dataset", values: np.ndarray, cases: Sequence[str], fill: float
) -> np.ndarray:
    """Return values of shape (pose, load_case, …) for other load cases; ``fill`` without one."""
    shape = (len(values), len(cases), *values.shape[2:])
    spread = np.full(shape, fill, dtype=values.dtype)
    spread[:, [cases.index(case) for case in dataset.load_cases]] = values
    return spread


def _check_compatible(first: "Dataset", other: "Dataset", index: int) -> None:
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
    if first.conditioned != other.conditioned:
        raise DatasetError(
            f"datasets 0 and {index} have different histories: {_history(first)} and"
            f" {_history(other)}"
        )
    allowed = {_ZERO_BY_DEFAULT, _UNMEASURED, *_OF_ONE_CAMPAIGN}
    for variable in sorted((set(first.arrays) ^ set(other.arrays)) - allowed):
        lacking = index if variable in first.arrays else 0
        raise DatasetError(
            f"dataset {lacking} has no variable {variable!r}, dataset {index - lacking} has:"
            " what was not measured cannot be filled in"
        )


def _history(dataset: "Dataset") -> str:
    return "conditioned" if dataset.conditioned else "free"


def _check_marker(first: "Dataset", other: "Dataset", index: int) -> None:
    here, there = first.marker, other.marker
    if here is None and there is None:
        return
    if here is None or there is None or not math.dist(here, there) <= _SAME_MARKER:
        raise DatasetError(
            f"datasets 0 and {index} have different markers: attribute 'marker' is"
            f" {_short(first.attributes.get('marker'))} in one and"
            f" {_short(other.attributes.get('marker'))} in the other"
        )


def merge_files(found: Sequence[tuple[Path, "Dataset"]]) -> tuple["Dataset", str]:
    """Return the readings of several files as one dataset, each a campaign, and their names.

    Parameters
    ----------
    found : sequence of (Path, Dataset)
        At least one, each with its file.

    Raises
    ------
    DatasetError
        If there is none, or they do not belong together; see `merge`.
    """
    if not found:
        raise DatasetError("nothing to calibrate from: give at least one dataset")
    files, read_ones = zip(*found, strict=True)
    source = ", ".join(map(str, files))
    if len(files) == 1:
        return read_ones[0], source
    # Two campaigns of one name in two folders are two campaigns.
    stems = [path.stem for path in files]
    names = stems if len(set(stems)) == len(stems) else [str(path) for path in files]
    try:
        return merge(read_ones, relabel=True, campaigns=names), source
    except DatasetError as error:
        raise DatasetError(f"{source}: {error}") from error


def _check_poses_differ(datasets: Sequence["Dataset"]) -> None:
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
