"""Pool file ``pool.nc``: every candidate that the search chose from, beside the plan.

NetCDF4, all in SI units; any tool that reads NetCDF opens it. What became of each sampled point is
a flag variable (CF conventions, section 3.5).
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.errors import PlanningError, SchemaError
from elastocal.planning.plan_result import POOL, PlanResult
from elastocal.records import LabelledArray, LabelledArrays, read_arrays, write_arrays

_SCHEMA = "elastocal.pool/1"
NOT_CHOSEN = -1
"""``pose_id`` of a candidate that is no pose of the plan."""
HAS_POSTURE = -1
"""``refused_by`` of a sampled point that became a candidate."""

_ARRAYS: dict[str, tuple[tuple[str, ...], type, str | None, str]] = {
    "contact": (("candidate", "axis"), float, "m", "contact point in base"),
    "normal": (("candidate", "axis"), float, "1", "outward unit normal of the surface in base"),
    "T_base_tcp": (("candidate", "row", "column"), float, None, "tcp frame in base, lengths in m"),
    "q": (("candidate", "joint"), float, None, "joint positions in contact, in rad or m"),
    "q_approach": (("candidate", "joint"), float, None, "joint positions off the surface"),
    "branch": (("candidate",), int, None, "branch of the inverse kinematics"),
    "margin": (("check", "candidate"), float, None, "distance from refusal, in check_units"),
    "boundary_distance": (("candidate",), float, "m", "distance from the edge of the surface"),
    "pose_id": (("candidate",), int, None, "pose of the plan; -1: not chosen"),
    "point": (("candidate",), int, None, "number of the sampled point"),
    "sampled": (("point_number", "axis"), float, "m", "every point that was tried, in base"),
    "refused_by": (("point_number",), int, None, "what left the point without a posture"),
}
"""Dimensions, type, unit and meaning of each array; the file's names are the fields' names."""
_LABELS = {"joint_names": "joint", "check_names": "check", "check_units": "check"}
_NAMES = ("joint_names", "check_names", "check_units", "refusal_names")


@dataclass(frozen=True, eq=False)
class PoolData:
    """Candidates with their postures and margins, and the points that have none.

    Arrays are copied and read-only.

    Raises
    ------
    PlanningError
        If shapes contradict each other or a number points at nothing.
    """

    contact: FloatArray
    """Contact points in base, shape (candidate, 3), in m."""
    normal: FloatArray
    """Outward unit normals in base, shape (candidate, 3)."""
    T_base_tcp: FloatArray
    """Contact frames, z into the surface, shape (candidate, 4, 4), in m."""
    q: FloatArray
    """Joint positions in contact, shape (candidate, joint), in rad or m."""
    q_approach: FloatArray
    """Joint positions at the approach pose, shape (candidate, joint), in rad or m."""
    joint_names: tuple[str, ...]
    branch: IndexArray
    """Inverse kinematics branch, shape (candidate,)."""
    margin: FloatArray
    """How far each check is from refusing, shape (check, candidate), in ``check_units``."""
    check_names: tuple[str, ...]
    check_units: tuple[str, ...]
    boundary_distance: FloatArray
    """Distance from the edge of the surface, shape (candidate,), in m; inf where there is none."""
    pose_id: IndexArray
    """Id of the pose in the plan, shape (candidate,); `NOT_CHOSEN` when it is none."""
    point: IndexArray
    """Which sampled point each candidate touches, shape (candidate,)."""
    sampled: FloatArray
    """Every point that was tried, in base, shape (point, 3), in m."""
    refused_by: IndexArray
    """Index into ``refusal_names``, shape (point,); `HAS_POSTURE` for a candidate's point."""
    refusal_names: tuple[str, ...]
    """Names of all that can leave a point without a posture: the robot's reach, then the checks."""

    def __post_init__(self) -> None:
        for name, (_, kind, _, _) in _ARRAYS.items():
            array = np.array(getattr(self, name), dtype=np.intp if kind is int else float)
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        for name in _NAMES:
            object.__setattr__(self, name, tuple(str(text) for text in getattr(self, name)))
        _check_shapes(self)
        _check_names(self)
        _check_range("point", self.point, 0, len(self.sampled))
        _check_range("refused_by", self.refused_by, HAS_POSTURE, len(self.refusal_names))
        _check_range("pose_id", self.pose_id, NOT_CHOSEN, len(self))

    def __len__(self) -> int:
        """Return the number of candidates."""
        return len(self.contact)


def write_pool(folder: Path, data: PoolData) -> Path:
    """Write ``pool.nc`` into a folder, atomically; return its path.

    Raises
    ------
    FileAccessError
        If it cannot be written.
    """
    path = Path(folder) / POOL
    write_arrays(path, _arrays_of(data))
    return path


def read_pool(folder: Path) -> PoolData:
    """Return the pool of a folder (or of the ``pool.nc`` itself).

    Raises
    ------
    SchemaError
        If it is no pool, has another schema or contradicts itself.
    FileAccessError
        If it cannot be read.
    """
    path = Path(folder)
    path = path / POOL if path.is_dir() else path
    found = read_arrays(path, _SCHEMA)
    try:
        return _pool_of(found)
    except PlanningError as error:
        raise SchemaError(f"{path}: {error}") from error


def check_pool_of(plan: PlanResult, data: PoolData, what: str = POOL) -> None:
    """Refuse a pool that a plan was not chosen from.

    Parameters
    ----------
    plan : PlanResult
        The plan.
    data : PoolData
        The pool that lies beside it.
    what : str
        How the message names the pool.

    Raises
    ------
    SchemaError
        If the joints, the number of candidates or points, or a pose's posture differ.
    """
    for quantity, ours, wanted in (
        ("joints", data.joint_names, plan.robot.joints),
        ("candidates", len(data), plan.pool.valid),
        ("sampled points", len(data.sampled), plan.pool.sampled),
        ("chosen candidates", int((data.pose_id != NOT_CHOSEN).sum()), len(plan.poses)),
    ):
        if ours != wanted:
            raise SchemaError(
                f"{what} belongs to another plan: {quantity} {ours}, in the plan {wanted}"
            )
    for pose in plan.poses:
        row = pose.candidate
        same = data.pose_id[row] == pose.id and tuple(data.q[row].tolist()) == pose.joints
        if not (same and np.allclose(data.contact[row], pose.tcp_position, rtol=0.0, atol=1e-6)):
            raise SchemaError(
                f"{what} belongs to another plan: its candidate {row} is not pose {pose.id}"
            )


def _arrays_of(data: PoolData) -> LabelledArrays:
    variables = {}
    for name, (dims, kind, unit, meaning) in _ARRAYS.items():
        values = getattr(data, name)
        values = values.astype(np.int32) if kind is int else values
        notes: dict[str, object] = {"long_name": meaning}
        if unit:
            notes["units"] = unit
        if name == "refused_by":
            notes["flag_values"] = np.arange(HAS_POSTURE, len(data.refusal_names), dtype=np.int32)
            notes["flag_meanings"] = " ".join(["none", *data.refusal_names])
        # Packed and so without a fill value: NaN and inf stay as they are, and integers integers.
        variables[name] = LabelledArray(dims, values, notes, packed=True)
    for name, dim in _LABELS.items():
        variables[name] = LabelledArray((dim,), np.array(getattr(data, name), dtype=np.str_))
    return LabelledArrays(variables, {"schema": _SCHEMA})


def _pool_of(found: LabelledArrays) -> PoolData:
    """Return the pool that a file holds; variables that are not ours are left alone."""
    lacking = [name for name in (*_ARRAYS, *_LABELS) if name not in found]
    if lacking:
        raise PlanningError(f"variable {lacking[0]!r} is missing")
    for name, (dims, _, _, _) in _ARRAYS.items():
        if found[name].dims != dims:
            raise PlanningError(f"{name} has dimensions {found[name].dims}, not {dims}")
    meanings = str(found["refused_by"].attributes.get("flag_meanings", "")).split()
    contents: Any = {name: found[name].values for name in _ARRAYS}
    contents |= {name: tuple(found[name].values.tolist()) for name in _LABELS}
    try:
        return PoolData(**contents, refusal_names=tuple(meanings[1:]))
    except (TypeError, ValueError) as error:
        raise PlanningError(" ".join(str(error).split())) from error


def _check_shapes(data: PoolData) -> None:
    """Refuse an array that does not have the size of its dimensions."""
    sizes = {
        "candidate": len(data.contact),
        "axis": 3,
        "row": 4,
        "column": 4,
        "joint": len(data.joint_names),
        "check": len(data.check_names),
        "point_number": len(data.sampled),
    }
    for name, (dims, _, _, _) in _ARRAYS.items():
        shape, wanted = getattr(data, name).shape, tuple(sizes[dim] for dim in dims)
        if shape != wanted:
            raise PlanningError(f"{name} of the pool has shape {shape}, not {wanted} {dims}")
    if len(data.check_units) != len(data.check_names):
        raise PlanningError(
            f"the pool has {len(data.check_names)} checks and {len(data.check_units)} units"
        )


def _check_names(data: PoolData) -> None:
    """Refuse names that the file's flag attribute cannot tell apart."""
    for name in data.refusal_names:
        if len(name.split()) != 1 or data.refusal_names.count(name) > 1:
            raise PlanningError(f"refusal name {name!r} of the pool must be one word, named once")


def _check_range(name: str, values: IndexArray, low: int, end: int) -> None:
    outside = values[(values < low) | (values >= end)]
    if outside.size:
        raise PlanningError(f"{name} of the pool holds {outside[0]}, allowed: {low} to {end - 1}")
