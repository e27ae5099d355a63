"""Table ``plan.csv``: one row a pose in visiting order, in units that people read.

The plan itself is ``plan.json``; this table is rounded and nothing reads it back.
"""

import shlex
from collections.abc import Iterator, Mapping
from pathlib import Path

from elastocal.planning.plan_result import Joints, PlanResult, PoseRecord
from elastocal.robot import Robot, xyzabc_from_T
from elastocal.tables import write_table as write_rows
from elastocal.units import factor

PLAN_TABLE = "plan.csv"
"""Name of the table in its folder."""

_SHOWN = {"rad": ("deg", "angle", 6), "m": ("mm", "length", 4)}
"""Unit, dimension and decimals in which a quantity of an SI unit is shown."""
_AXES = ("x", "y", "z")
_ANGLES = ("a", "b", "c")


def write_table(folder: Path, plan: PlanResult) -> Path:
    """Write ``plan.csv`` into a folder, atomically; return its path.

    Columns: pose, candidate, rank in the search, joints in contact and at the approach pose, tcp
    in base (KUKA Z-Y'-X''), normal, station, time, and the margin of every check. Lengths in mm
    to 1e-4, angles in deg to 1e-6.

    Raises
    ------
    RobotError
        If the plan's robot cannot be read.
    FileAccessError
        If the file cannot be written.
    """
    robot = Robot.from_urdf(plan.robot.urdf, plan.robot.tcp, plan.robot.base)
    rank = {pose: number for number, pose in enumerate(plan.search.order)}
    rows = [_row(plan, pose, rank[pose.id], robot.revolute) for pose in plan.poses]
    header = list(dict.fromkeys(key for row in rows for key in row))
    path = Path(folder) / PLAN_TABLE
    write_rows(path, header, ([row.get(key, "") for key in header] for row in rows))
    return path


def pose_lines(plan: PlanResult, seconds: Mapping[int, float] | None = None) -> Iterator[str]:
    """Yield a line a pose, in visiting order: words ``key=value``, for programs and for people.

    ``pose=0 start[s]=0.0 time[s]=34.8 station=tracker rail[mm]=… joint_a1[deg]=…``: the joints are
    those in contact, the time is that of the motion to the pose and at it.

    Parameters
    ----------
    seconds : mapping of int to float, optional
        Time of each pose, by its id, in s; by default the plan's own.

    Raises
    ------
    RobotError
        If the plan's robot cannot be read.
    """
    robot = Robot.from_urdf(plan.robot.urdf, plan.robot.tcp, plan.robot.base)
    start = 0.0
    for pose, move in zip(plan.poses, plan.moves, strict=False):
        lasts = move.duration + pose.contact_time if seconds is None else seconds[pose.id]
        row: dict[str, object] = {
            "pose": pose.id,
            "start[s]": f"{start:.1f}",
            "time[s]": f"{lasts:.1f}",
        }
        row |= {"station": shlex.quote(pose.seen_by or "")}
        row |= _joints(plan.robot.joints, pose.joints, robot.revolute)
        yield " ".join(f"{key}={value}" for key, value in row.items())
        start += lasts


def _row(
    plan: PlanResult, pose: PoseRecord, rank: int, revolute: tuple[bool, ...]
) -> dict[str, object]:
    units = {check.name: check.unit or "1" for check in plan.pool.checks}
    row: dict[str, object] = {
        "pose": pose.id,
        "candidate": pose.candidate,
        "search_rank": rank,
        "seen_by": pose.seen_by or "",
    }
    row |= _joints(plan.robot.joints, pose.joints, revolute)
    approach = tuple(f"approach_{name}" for name in plan.robot.joints)
    row |= _joints(approach, pose.approach_joints, revolute)
    xyzabc = xyzabc_from_T(pose.T_base_tcp).tolist()
    for name, value in zip((*_AXES, *_ANGLES), xyzabc, strict=True):
        row |= _cell(name, value, "m" if name in _AXES else "rad")
    row |= {f"normal_{axis}": f"{n:.9f}" for axis, n in zip(_AXES, pose.normal, strict=True)}
    row |= _cell("contact_time", pose.contact_time, "s")
    for name, margin in pose.margins.items():
        row |= _cell(f"margin_{name}", margin, units[name])
    return row


def _joints(
    names: tuple[str, ...], values: Joints, revolute: tuple[bool, ...]
) -> dict[str, object]:
    cells: dict[str, object] = {}
    for name, value, turns in zip(names, values, revolute, strict=True):
        cells |= _cell(name, value, "rad" if turns else "m")
    return cells


def _cell(name: str, value: float, unit: str) -> dict[str, object]:
    """Return a column header with its unit, and the rounded value."""
    if unit not in _SHOWN:
        return {f"{name}[{unit}]": f"{value:.6g}"}
    shown, dimension, decimals = _SHOWN[unit]
    number = round(value / factor(shown, dimension), decimals)
    # A value that rounds to -0 would be shown as -0.000000.
    return {f"{name}[{shown}]": f"{number + 0.0:.{decimals}f}"}
