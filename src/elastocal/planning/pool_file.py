"""Pool file ``pool.nc``: every candidate that the search chose from, beside the plan.

NetCDF4, all in SI units; any tool that reads NetCDF opens it. What became of each sampled point is
a flag variable (CF conventions, section 3.5).
"""

from pathlib import Path
from typing import Annotated

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.errors import PlanningError, SchemaError
from elastocal.planning.plan_result import POOL, PlanResult
from elastocal.planning.postures import read_only
from elastocal.records import Variable, read_netcdf, record, variables_of, write_netcdf
from elastocal.results import brief_repr

_SCHEMA = "elastocal.pool/1"
NOT_CHOSEN = -1
"""``pose_id`` of a candidate that is no pose of the plan."""
HAS_POSTURE = -1
"""``refused_by`` of a sampled point that became a candidate."""

_INDICES = ("branch", "pose_id", "point", "refused_by")
_NAMES = ("joint_names", "check_names", "check_units", "refusal_names")


@brief_repr
@record(_SCHEMA, eq=False)
class PoolData:
    """Candidates with their postures and margins, and the points that have none.

    Arrays are copied and read-only.

    Raises
    ------
    PlanningError
        If shapes contradict each other or a number points at nothing.
    """

    contact: Annotated[FloatArray, Variable(("candidate", "axis"), "m", "contact point in base")]
    """Contact points in base, shape (candidate, 3), in m."""
    normal: Annotated[
        FloatArray,
        Variable(("candidate", "axis"), "1", "outward unit normal of the surface in base"),
    ]
    """Outward unit normals in base, shape (candidate, 3)."""
    T_base_tcp: Annotated[
        FloatArray,
        Variable(("candidate", "row", "column"), meaning="tcp frame in base, lengths in m"),
    ]
    """Contact frames, z into the surface, shape (candidate, 4, 4), in m."""
    q: Annotated[
        FloatArray,
        Variable(("candidate", "joint"), meaning="joint positions in contact, in rad or m"),
    ]
    """Joint positions in contact, shape (candidate, joint), in rad or m."""
    q_approach: Annotated[
        FloatArray, Variable(("candidate", "joint"), meaning="joint positions off the surface")
    ]
    """Joint positions at the approach pose, shape (candidate, joint), in rad or m."""
    joint_names: Annotated[tuple[str, ...], Variable(("joint",))]
    branch: Annotated[
        IndexArray, Variable(("candidate",), meaning="branch of the inverse kinematics")
    ]
    """Inverse kinematics branch, shape (candidate,)."""
    margin: Annotated[
        FloatArray,
        Variable(("check", "candidate"), meaning="distance from refusal, in check_units"),
    ]
    """Margin of each check, shape (check, candidate), in ``check_units``."""
    check_names: Annotated[tuple[str, ...], Variable(("check",))]
    check_units: Annotated[tuple[str, ...], Variable(("check",))]
    boundary_distance: Annotated[
        FloatArray, Variable(("candidate",), "m", "distance from the edge of the surface")
    ]
    """Distance from the edge of the surface, shape (candidate,), in m; inf where there is none."""
    pose_id: Annotated[
        IndexArray, Variable(("candidate",), meaning="pose of the plan; -1: not chosen")
    ]
    """Id of the pose in the plan, shape (candidate,); `NOT_CHOSEN` if it was not chosen."""
    point: Annotated[IndexArray, Variable(("candidate",), meaning="number of the sampled point")]
    """Sampled point that each candidate touches, shape (candidate,)."""
    sampled: Annotated[
        FloatArray, Variable(("point_number", "axis"), "m", "every point that was tried, in base")
    ]
    """Every point that was tried, in base, shape (point, 3), in m."""
    refused_by: Annotated[
        IndexArray,
        Variable(
            ("point_number",),
            meaning="what left the point without a posture",
            flags="refusal_names",
        ),
    ]
    """Index into ``refusal_names``, shape (point,); `HAS_POSTURE` for a candidate's point."""
    refusal_names: tuple[str, ...]
    """Names of all that can leave a point without a posture: the reach, then the checks."""

    def __post_init__(self) -> None:
        for name in variables_of(PoolData):
            if name not in _NAMES:
                dtype = np.intp if name in _INDICES else float
                object.__setattr__(self, name, read_only(getattr(self, name), dtype))
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
    write_netcdf(path, data)
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
    return read_netcdf(path, PoolData)


def check_pool_of(plan: PlanResult, data: PoolData, what: str = POOL) -> None:
    """Refuse a pool that a plan was not chosen from.

    Parameters
    ----------
    data : PoolData
        The pool that lies beside it.
    what : str
        How the message names the pool.

    Raises
    ------
    SchemaError
        If the joints, the number of candidates or points, or a pose's posture differ.
    """
    # A place that is pressed on two disks as well is one candidate.
    single = [pose for pose in plan.poses if pose.doubles is None]
    for quantity, ours, wanted in (
        ("joints", data.joint_names, plan.robot.joints),
        ("candidates", len(data), plan.pool.valid),
        ("sampled points", len(data.sampled), plan.pool.sampled),
        ("chosen candidates", int((data.pose_id != NOT_CHOSEN).sum()), len(single)),
    ):
        if ours != wanted:
            raise SchemaError(
                f"{what} belongs to another plan: {quantity} {ours}, in the plan {wanted}"
            )
    for pose in single:
        row = pose.candidate
        same = data.pose_id[row] == pose.id and tuple(data.q[row].tolist()) == pose.joints
        if not (same and np.allclose(data.contact[row], pose.tcp_position, rtol=0.0, atol=1e-6)):
            raise SchemaError(
                f"{what} belongs to another plan: its candidate {row} is not pose {pose.id}"
            )


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
    for name, variable in variables_of(PoolData).items():
        dims, wanted = variable.dims, tuple(sizes[dim] for dim in variable.dims)
        if name not in _NAMES and getattr(data, name).shape != wanted:
            shape = getattr(data, name).shape
            raise PlanningError(f"{name} of the pool has shape {shape}, not {wanted} {dims}")
    if len(data.check_units) != len(data.check_names):
        raise PlanningError(
            f"the pool has {len(data.check_names)} checks and {len(data.check_units)} units"
        )


def _check_names(data: PoolData) -> None:
    """Refuse names that the file's flag attribute cannot distinguish."""
    for name in data.refusal_names:
        if len(name.split()) != 1 or data.refusal_names.count(name) > 1:
            raise PlanningError(f"refusal name {name!r} of the pool must be one word, named once")


def _check_range(name: str, values: IndexArray, low: int, end: int) -> None:
    outside = values[(values < low) | (values >= end)]
    if outside.size:
        raise PlanningError(f"{name} of the pool holds {outside[0]}, allowed: {low} to {end - 1}")
