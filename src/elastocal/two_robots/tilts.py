"""What presses of two arms on each other do not see, in words.

The force on both arms is the same but for its sign, and so is its torque about the line ``u`` that
joins the origins of both bases. A base that tilts about that line moves its tool, at ``p`` from a
point of the line, by

    tilt(p, f) = (u x p) (u . (p x f)) c,

which depends on the tool and the force alone, not on which arm it is: adding to the tilt of one arm
what is taken off that of the other changes no press. This holds for any springs that can express
the tilt, which is found by trying. Springs that lie across the line express it only together with
terms that no such spring has, so that they seem to tell the two arms apart: by an assumption about
their axes, not by what was measured.
"""

from collections.abc import Sequence

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.elastic import ElasticModel
from elastocal.findings import Finding, Grade, Kind
from elastocal.two_robots.presses import PairModel

_PROBES, _SEED = 40, 0
"""Random configurations and forces by which a tilt is looked for among the springs."""
_EXPRESSED = 1e-6
"""Part of a tilt that springs may leave over and still express it."""

TILT = Kind(
    "two-robots.tilt",
    "how much each base tilts about the line that joins both bases is not seen, only the sum of"
    " both: every press turns {first} and {second} about it alike",
    advice="Calibrate one arm alone, by a tracker or on a plate, and name its model in the cell"
    " file (robots: model); predictions of the deviation between the tools need only the sum.",
)
TILT_KNOWN = Kind(
    "two-robots.tilt-known",
    "how much each base tilts about the line that joins both bases is taken from the model of"
    " {known}: the presses see only the sum of both",
    grade=Grade.NOTE,
)
TILT_BY_AXES = Kind(
    "two-robots.tilt-by-axes",
    "how much each base tilts about the line that joins both bases is told apart only because the"
    " springs of {first} and {second} lie along the axes of their bases, and not along that line",
    advice="Where the axes of bearings are not those of the robot's description, calibrate one arm"
    " alone, by a tracker or on a plate, and name its model in the cell file (robots: model).",
    grade=Grade.NOTE,
)


def tilt_column(point: FloatArray, force: FloatArray, line: FloatArray) -> FloatArray:
    """Return ``(u x p) (u . (p x f))``: the column of a tilt about a line.

    Parameters
    ----------
    point : ndarray, shape (row, 3)
        Tcp from a point of the line, in m.
    force : ndarray, shape (row, 3)
        Force there, in N.
    line : ndarray, shape (3,)
        Unit vector along the line.

    Returns
    -------
    ndarray, shape (row, 3)
        In m per rad/(N·m).
    """
    torque = np.cross(point, force) @ line
    return np.asarray(np.cross(line, point) * torque[:, None])


def expresses_tilt(model: ElasticModel, line: FloatArray) -> bool:
    """Return whether the springs of an arm hold the tilt of its base about a line through it.

    Parameters
    ----------
    model : ElasticModel
        The arm; its base is on the line.
    line : ndarray, shape (3,)
        Unit vector in its base.
    """
    rng, limits = np.random.default_rng(_SEED), model.robot.limits
    lower, upper = np.maximum(limits.lower, -np.pi), np.minimum(limits.upper, np.pi)
    q = rng.uniform(lower, upper, (_PROBES, len(lower)))
    force = rng.standard_normal((_PROBES, 3))
    O = model.observation_blocks(q, force).reshape(3 * _PROBES, -1)  # noqa: E741 - paper
    wanted = tilt_column(model.robot.forward(q)[:, :3, 3], force, line).ravel()
    norms = np.linalg.norm(O, axis=0)
    scaled = O / np.where(norms > 0.0, norms, 1.0)
    left = wanted - scaled @ np.linalg.lstsq(scaled, wanted, rcond=None)[0]
    return bool(np.linalg.norm(left) <= _EXPRESSED * np.linalg.norm(wanted))


def tilt_finding(
    model: PairModel, T_first_second: FloatArray, known: Sequence[str] = ()
) -> Finding | None:
    """Return what the presses say of tilts about the line that joins both bases.

    None where the springs hold no tilt of the bases.

    Parameters
    ----------
    model : PairModel
        Springs of both arms.
    T_first_second : ndarray, shape (4, 4)
        Base of the second robot in that of the first.
    known : sequence of str
        Arms whose model was known before.
    """
    first, second = model.names
    line = T_first_second[:3, 3] / np.linalg.norm(T_first_second[:3, 3])
    lines = line, T_first_second[:3, :3].T @ line
    if all(expresses_tilt(arm, own) for arm, own in zip(model.models, lines, strict=True)):
        return TILT_KNOWN(known=known[0]) if known else TILT(first=first, second=second)
    tilts = [any(expresses_tilt(arm, axis) for axis in np.eye(3)[:2]) for arm in model.models]
    return TILT_BY_AXES(first=first, second=second) if all(tilts) else None
