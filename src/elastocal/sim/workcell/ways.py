"""The ways that a command can take: from where the robot stands to where it will."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.sim.workcell.contact import Contact
from elastocal.sim.workcell.quasistatics import Quasistatics, Stand
from elastocal.sim.workcell.segment import Knots

CLOSED = 1e-8
"""How far the tool may end from where the contact holds it, in m: 0.03 N of the disk."""
_STEPS = 8
"""Pieces of a free movement between knots."""
_ROUNDS = 8


@dataclass(frozen=True, eq=False)
class Way:
    """A way and where it leads."""

    knots: Knots
    end: Stand


def joint_way(statics: Quasistatics, start: Stand, end: Stand) -> Way:
    """Return the straight way in joint space; the small deviations change evenly."""
    progress = np.linspace(0.0, 1.0, _STEPS + 1)
    q = _between(start.q, end.q, progress)
    twist = _between(start.twist, end.twist, progress)
    return Way(statics.knots(progress, q, twist, np.zeros((len(q), 3))), end)


def line_way(statics: Quasistatics, stands: list[Stand]) -> Way:
    """Return the straight way of the tool through some stands, by its length.

    Parameters
    ----------
    statics : Quasistatics
        The robot.
    stands : list of Stand
        All with the same commanded orientation, on one line; those where nothing moves are left
        out, but for the last.
    """
    T = statics.robot.forward(np.stack([stand.q for stand in stands]))
    at = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(T[:, :3, 3], axis=0), axis=1))])
    at = at / at[-1] if at[-1] > 0.0 else np.linspace(0.0, 1.0, len(stands))
    fine = np.unique(np.concatenate([at, np.linspace(0.0, 1.0, _STEPS + 1)]))
    columns = (
        np.stack([getattr(stand, name) for stand in stands]) for name in ("twist", "force", "q")
    )
    twist, force, coarse = (_interpolated(at, column, fine) for column in columns)
    points = _interpolated(at, T[:, :3, 3], fine)
    q = statics.along(stands[0].q, T[0, :3, :3], points[1:-1])
    q = np.concatenate([coarse[:1], q, coarse[-1:]])
    return Way(statics.knots(fine, q, twist, force), stands[-1])


def force_way(statics: Quasistatics, start: Stand, end: Stand) -> Way:
    """Return the way on which the force goes straight from one to the other."""
    both = (start, end)
    q, twist, force = (np.stack([getattr(s, n) for s in both]) for n in ("q", "twist", "force"))
    return Way(statics.knots(np.array([0.0, 1.0]), q, twist, force), end)


def pressed(
    statics: Quasistatics,
    start: Stand,
    contact: Contact,
    force: Callable[[FloatArray], FloatArray],
    stop_error: FloatArray,
) -> Stand:
    """Return the equilibrium of robot, disk and tooling under a force.

    The commanded pose moves, orientation kept, until the tool is where disk and tooling hold it;
    the robot gives a little differently there, so it is done in rounds.

    Parameters
    ----------
    statics : Quasistatics
        The robot.
    start : Stand
        Where it comes from, with its memory.
    contact : Contact
        The disk on the tooling.
    force : callable
        Returns the force on the robot in base, shape (3,), in N, from the true orientation of the
        sensor in base, shape (3, 3).
    stop_error : ndarray, shape (3,)
        Error of the stop, in base, in m.
    """
    q, reached = start.q, start
    for _ in range(_ROUNDS):
        wanted = force(statics.R_base_sensor(q, reached.twist))
        reached = statics.loaded(replace(start, theta=reached.theta), q, wanted, stop_error)
        goal = contact.tool_position(wanted)
        if np.linalg.norm(goal - statics.tool_position(reached)) < CLOSED:
            break
        q = statics.along(q, contact.R_base_tcp, (goal - reached.twist[:3])[None])[0]
    return reached


def touching(statics: Quasistatics, start: Stand, at: FloatArray, error: FloatArray) -> Stand:
    """Return the robot with its tool truly at a point, without force, orientation kept.

    Parameters
    ----------
    statics : Quasistatics
        The robot.
    start : Stand
        Where it comes from.
    at : ndarray, shape (3,)
        In base, in m.
    error : ndarray, shape (3,)
        Error of the stop, in base, in m.
    """
    R = statics.robot.forward(start.q)[:3, :3]
    reached = start
    for _ in range(_ROUNDS):
        q = statics.along(reached.q, R, (at - reached.twist[:3])[None])[0]
        reached = statics.free(q, error, reached.theta)
        if np.linalg.norm(at - statics.tool_position(reached)) < CLOSED:
            break
    return reached


def _between(start: FloatArray, end: FloatArray, progress: FloatArray) -> FloatArray:
    between: FloatArray = start + progress[:, None] * (end - start)
    between[-1] = end
    return between


def _interpolated(at: FloatArray, values: FloatArray, fine: FloatArray) -> FloatArray:
    return np.stack([np.interp(fine, at, column) for column in values.T], axis=1)
