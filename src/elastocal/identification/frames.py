"""Unknown frames: the tracker was set up again, or the marker was mounted again.

In session ``k`` a tracker that is off by a small rotation ``w_k`` about a mean point ``x_m`` and a
translation ``t_k``, measuring a marker that is ``e_k`` away from its nominal place in the tcp
frame, reads

    y = x + t_k + w_k x (x - x_m) + R e_k,

with the marker's true place ``x`` and the tcp's rotation ``R``, both in base. A displacement is the
difference of a loaded reading in session ``k`` and a reference in session ``0``:

    dy = dx + t + w x (x - x_m) + R e  +  [w_0 x dx + dR e_0],
    t = t_k - t_0,  w = w_k - w_0,  e = e_k - e_0.

The bracket is of second order: between reference and load the marker travels millimetres and turns
by milliradians, so that 100 urad or 100 um make some tenths of a micrometre of it. So of the nine
numbers of a session

* nothing survives where reference and loaded reading belong to the *same* session: neither a bad
  registration nor a bad lever arm shows in displacements (the estimate comes out as zero, at the
  price of nine numbers);
* all nine survive, as differences, where the reference was read in *another* session: the robot
  empty on Monday, with a payload on Tuesday. Then ``t`` and ``e`` are distinguished only by poses
  of different orientation, ``w`` only by points that are spread, and neither from springs that
  deflect all poses alike.

They are columns of the observation system beside those of the springs, without bounds. A prior
keeps undetermined combinations at zero; it is too weak to affect the determined ones.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.dataset import Readings
from elastocal.errors import IdentificationError
from elastocal.identification.options import FreeFrame
from elastocal.records import record
from elastocal.results import brief_repr
from elastocal.robot import Robot
from elastocal.wording import counted

NUMBERS = 9
"""Columns of a session: translation, rotation, marker."""
_LEAST_POSES = 5
"""Poses that a session needs: three for its nine numbers, one that says anything of the springs
beside them, and one that a refit leaves out."""
_SIZE = 1e-4
"""A sensible size of each, in m or rad."""
_WIDE = 1e-2
"""Standard deviation of the prior, in m or rad: no registration is worse."""
_NOISE = 1e-5
"""Standard deviation against which the prior is weighted, in m: a reading of a tracker."""


@brief_repr
@dataclass(frozen=True, eq=False)
class FrameColumns:
    """Columns of the sessions in an observation system."""

    names: tuple[str, ...]
    """Name of each session."""
    columns: FloatArray
    """Shape (reading, 3, 9 sessions), in m per m or rad."""

    def __len__(self) -> int:
        """Return the number of columns."""
        return int(self.columns.shape[2])

    @property
    def size(self) -> FloatArray:
        """A sensible size of each number, shape (column,), in m or rad."""
        return np.full(len(self), _SIZE)

    @property
    def prior(self) -> FloatArray:
        """Rows of the prior on the columns, shape (column, column)."""
        return np.eye(len(self)) * _NOISE / _WIDE


@brief_repr
@record()
class FrameSummary:
    """Estimated frame of a session relative to that of its references."""

    name: str
    """Load case, campaign, or both."""
    translation: tuple[float, ...]
    """Shift of the tracker at the mean point of the session, in base, in m."""
    rotation: tuple[float, ...]
    """Rotation of the tracker about that point, in base, in rad."""
    marker: tuple[float, ...]
    """Shift of the marker in the tcp frame, in m."""
    half_width: tuple[float, ...]
    """Half the 95 % interval of these nine; as wide as the prior's where poses say nothing."""


def frame_columns(
    robot: Robot, readings: Readings, free: FreeFrame, marker_offset: ArrayLike | None = None
) -> FrameColumns:
    """Return the columns of the frames that are free.

    Parameters
    ----------
    readings : Readings
        With joints in the robot's order.
    free : str
        ``none``; ``load_case``: one frame for each load case (of each campaign); ``campaign``.
    marker_offset : array_like, shape (3,), optional
        Marker in the tcp frame, in m.

    Raises
    ------
    IdentificationError
        If campaigns are requested and the readings name none, or a session has too few poses.
    """
    if free == "none":
        return FrameColumns((), np.zeros((len(readings), 3, 0)))
    session = _sessions(readings, free)
    names = tuple(dict.fromkeys(session.tolist()))
    _require_poses(readings, session, names, free)
    T_base_tcp = robot.forward(readings.joint_position)
    R = T_base_tcp[:, :3, :3]
    marker = np.zeros(3) if marker_offset is None else np.asarray(marker_offset, dtype=float)
    x = T_base_tcp[:, :3, 3] + R @ marker
    columns = np.zeros((len(readings), 3, len(names) * NUMBERS))
    for number, name in enumerate(names):
        rows = np.flatnonzero(session == name)
        block = columns[:, :, number * NUMBERS : (number + 1) * NUMBERS]
        block[rows, :, 0:3] = np.eye(3)
        # w x r, a column for each axis of w.
        arm = (x[rows] - x[rows].mean(axis=0))[:, None, :]
        block[rows, :, 3:6] = np.cross(np.eye(3), arm).swapaxes(1, 2)
        block[rows, :, 6:9] = R[rows]
    return FrameColumns(names, columns)


def _sessions(readings: Readings, free: FreeFrame) -> np.ndarray:
    """Return the session of each reading, shape (reading,)."""
    campaign = readings.campaign
    if free == "campaign":
        if campaign is None:
            raise IdentificationError(
                "the readings name no campaigns whose frames could be free: give several datasets,"
                " or one with the coordinate campaign"
            )
        return campaign
    if campaign is None:
        return readings.load_case
    pairs = zip(campaign.tolist(), readings.load_case.tolist(), strict=True)
    return np.array([f"{name}, {case}" for name, case in pairs])


def _require_poses(
    readings: Readings, session: np.ndarray, names: Sequence[str], free: FreeFrame
) -> None:
    """Refuse sessions with fewer poses than their frames need."""
    poses = {name: len(np.unique(readings.pose[session == name])) for name in names}
    if not (few := [name for name in names if poses[name] < _LEAST_POSES]):
        return
    worst = min(few, key=lambda name: poses[name])
    more = f" ({len(few) - 1} more have too few)" if len(few) > 1 else ""
    raise IdentificationError(
        f"{free.replace('_', ' ')} {worst!r} was read at {counted(poses[worst], 'pose')}{more}: a"
        f" frame that is free has {NUMBERS} numbers, and needs readings at {_LEAST_POSES} poses and"
        " more beside the springs; leave such readings out (--exclude), or give --free-frame none"
    )


def frame_summaries(
    names: tuple[str, ...], values: FloatArray, ends: tuple[FloatArray, FloatArray]
) -> tuple[FrameSummary, ...]:
    """Return the frames of a fit.

    Parameters
    ----------
    names : tuple of str
        Sessions.
    values : ndarray, shape (9 sessions,)
        Their numbers.
    ends : tuple of ndarray, shape (9 sessions,)
        Lower and upper ends of their 95 % intervals.
    """

    def each() -> Iterator[FrameSummary]:
        for number, name in enumerate(names):
            own = slice(number * NUMBERS, (number + 1) * NUMBERS)
            t, w, e = values[own].reshape(3, 3).tolist()
            half = 0.5 * (ends[1] - ends[0])[own]
            yield FrameSummary(name, tuple(t), tuple(w), tuple(e), tuple(half.tolist()))

    return tuple(each())
