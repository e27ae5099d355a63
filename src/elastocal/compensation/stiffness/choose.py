"""The best postures: one that holds along the whole path, and the stiffest at each station."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.stiffness.survey import Survey
from elastocal.robot.inverse import InverseKinematics, OpwInverse


@dataclass(frozen=True, eq=False)
class Hold:
    """Postures along the path, one a station."""

    name: str
    q: FloatArray
    """Shape (station, joint), in rad or m; NaN where there is none."""
    spin: FloatArray
    """From the programmed orientation, shape (station,), in rad."""


@dataclass(frozen=True, eq=False)
class Choice:
    """What to program."""

    one: Hold | None
    """One spin, one stand and one branch that are allowed at every station, and of these the
    stiffest where it is softest; None: there is none."""
    each: Hold
    """The stiffest posture of each station, however far from that of its neighbour."""


def choose(survey: Survey, solver: InverseKinematics) -> Choice:
    """Return the best postures of a survey.

    Parameters
    ----------
    survey : Survey
        All postures.
    solver : InverseKinematics
        That found them. Only the closed form's branches go on from station to station; of another
        solver's, the stiffest of each station stands for all.
    """
    stiffness = np.where(np.isnan(survey.stiffness), -np.inf, survey.stiffness)
    flat = stiffness.reshape(len(stiffness), -1)
    each = _held(survey, "stiffest at each station", flat.argmax(axis=1))
    follows = isinstance(solver, OpwInverse)
    kept = stiffness if follows else stiffness.max(axis=-1, keepdims=True)
    softest = kept.min(axis=0)
    best = int(softest.argmax())
    if not softest.max() > 0.0:
        return Choice(None, each)
    if follows:
        one = np.full(len(stiffness), best)
    else:
        stiffest = stiffness.argmax(axis=-1).reshape(len(stiffness), -1)
        one = stiffness.shape[-1] * best + stiffest[:, best]
    return Choice(_held(survey, "one posture for the path", one), each)


def _held(survey: Survey, name: str, index: np.ndarray) -> Hold:
    stations = np.arange(len(survey.q))
    spin = np.unravel_index(index, survey.stiffness.shape[1:])[0]
    joints = survey.q.shape[-1]
    q = survey.q.reshape(len(stations), -1, joints)[stations, index].copy()
    refused = np.isnan(survey.stiffness.reshape(len(stations), -1)[stations, index])
    q[refused] = np.nan
    return Hold(name, q, np.where(~refused, survey.grid.spins[spin], np.nan))
