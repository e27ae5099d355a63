"""Tool mass, centre of mass, bias and drift by the unloaded references of a whole run.

With the equations of `elastocal.procedure.tool_weight` and a bias that drifts linearly, the
unloaded readings are linear in the mass, ``h = mass c``, biases and drifts:

    F_i = R_i^T g mass + b + d (t_i - t_mean),
    M_i = -[R_i^T g]x h + b_m + d_m (t_i - t_mean).

Ordinary least squares with intervals by Student's t; what the orientations do not tell apart is
NaN, and named.
"""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from elastocal.arrays import FloatArray
from elastocal.procedure.tool_change import ToolChange, tool_change

LEVEL = 0.95
"""Of the intervals."""
WIDE_MASS = 0.2
"""Half interval of the mass, as a share of it, beyond which it counts as not determined."""
WIDE_CENTRE = 0.05
"""Half interval of a coordinate of the centre of mass beyond which it is not determined, in m."""
_DEPENDENT = 1e-8
"""Ratio of singular values, columns scaled, below which columns depend on one another."""

NAMES = (
    "mass",
    *(f"{what} {axis}" for what in ("force bias", "force drift") for axis in "xyz"),
)
MOMENT_NAMES = tuple(
    f"{what} {axis}" for what in ("centre of mass", "moment bias", "moment drift") for axis in "xyz"
)


@dataclass(frozen=True, eq=False)
class Unloaded:
    """Raw wrenches of unloaded references, in the order of time."""

    time: FloatArray
    """Shape (reading,), in s."""
    force: FloatArray
    """Sensor frame, shape (reading, 3), in N."""
    moment: FloatArray
    """Sensor frame, shape (reading, 3), in N·m."""
    R_base_sensor: FloatArray
    """Rotation of the sensor, shape (reading, 3, 3)."""
    gravity: FloatArray
    """In base, shape (3,), in m/s²."""


@dataclass(frozen=True, eq=False)
class Interval:
    """An estimate with the half width of its 95 % interval; both NaN where not determined."""

    value: FloatArray
    half_width: FloatArray


@dataclass(frozen=True, eq=False)
class ToolEstimate:
    """What the unloaded references say of tool and sensor."""

    count: int
    """Unloaded references."""
    mass: Interval
    """Shape (), in kg."""
    centre: Interval
    """In the sensor's frame, shape (3,), in m."""
    force_bias: Interval
    """At the middle of the run, shape (3,), in N."""
    moment_bias: Interval
    """At the middle of the run, shape (3,), in N·m."""
    force_drift: Interval
    """Shape (3,), in N/s."""
    moment_drift: Interval
    """Shape (3,), in N·m/s."""
    force_scatter: float
    """Standard deviation of what is left of a component, in N; NaN where nothing is left over."""
    moment_scatter: float
    """The same of the moment, in N·m."""
    undetermined: tuple[str, ...]
    """Names of what the orientations and times do not tell apart."""
    change: ToolChange | None = None
    """Where one mass does not fit the whole run: mass, centre and biases are then those of no
    tool."""


def estimate_tool(unloaded: Unloaded, nominal_mass: float) -> ToolEstimate:
    """Return what the unloaded references say of tool and sensor.

    Parameters
    ----------
    unloaded : Unloaded
        At least none; with few or similar orientations little is determined.
    nominal_mass : float
        Mass of the tool by the cell file, in kg: the scale of what is too wide, and the divisor
        of the centre of mass where the mass is not determined.
    """
    time = unloaded.time - unloaded.time.mean() if len(unloaded.time) else unloaded.time
    gravity = unloaded.gravity @ unloaded.R_base_sensor
    eye = np.broadcast_to(np.eye(3), (len(time), 3, 3))
    drift = eye * time[:, None, None]
    blocks = np.concatenate([gravity[:, :, None], eye, drift], axis=2)
    force = _solve(blocks, unloaded.force)
    turn = np.cross(np.eye(3)[None], gravity[:, None, :]).swapaxes(1, 2)
    moment = _solve(np.concatenate([turn, eye, drift], axis=2), unloaded.moment)
    wide_mass = not force.half_width[0] <= WIDE_MASS * max(nominal_mass, 1.0)
    mass = nominal_mass if wide_mass else max(float(force.value[0]), WIDE_MASS * nominal_mass)
    centre = Interval(moment.value[:3] / mass, moment.half_width[:3] / mass)
    wide_centre = ~(centre.half_width <= WIDE_CENTRE)
    unknown = [*_named(NAMES, force.half_width), *_named(MOMENT_NAMES, moment.half_width)]
    unknown += ["mass"] * wide_mass
    unknown += [MOMENT_NAMES[axis] for axis in np.flatnonzero(wide_centre)]
    return ToolEstimate(
        count=len(time),
        mass=_masked(force.value[0], force.half_width[0], np.array(wide_mass)),
        centre=_masked(centre.value, centre.half_width, wide_centre),
        force_bias=_part(force, 1),
        moment_bias=_part(moment, 3),
        force_drift=_part(force, 4),
        moment_drift=_part(moment, 6),
        force_scatter=force.scatter,
        moment_scatter=moment.scatter,
        undetermined=tuple(dict.fromkeys(unknown)),
        change=tool_change(blocks, unloaded.force, gravity, nominal_mass),
    )


@dataclass(frozen=True, eq=False)
class _Solution(Interval):
    scatter: float


def _solve(blocks: FloatArray, readings: FloatArray) -> _Solution:
    """Return the least-squares solution of stacked blocks, shape (reading, 3, unknown)."""
    unknowns = blocks.shape[2]
    A, b = blocks.reshape(-1, unknowns), readings.ravel()
    free = len(b) - unknowns
    nothing = np.full(unknowns, np.nan)
    if free < 1:
        return _Solution(nothing, nothing, float("nan"))
    scale = np.linalg.norm(A, axis=0)
    scale[scale == 0] = 1.0
    u, s, vt = np.linalg.svd(A / scale, full_matrices=False)
    kept = s > _DEPENDENT * s[0]
    value = (vt[kept].T @ ((u[:, kept].T @ b) / s[kept])) / scale
    left = b - A @ value
    scatter = float(np.sqrt(left @ left / (free + int((~kept).sum()))))
    sigma = scatter * np.sqrt(((vt[kept] / s[kept, None]) ** 2).sum(axis=0)) / scale
    half = stats.t.ppf(0.5 + LEVEL / 2, free) * sigma
    loose = np.linalg.norm(vt[~kept], axis=0) > np.sqrt(_DEPENDENT)
    return _Solution(np.where(loose, np.nan, value), np.where(loose, np.nan, half), scatter)


def _part(solution: _Solution, start: int) -> Interval:
    rows = slice(start, start + 3)
    return Interval(solution.value[rows], solution.half_width[rows])


def _masked(value: FloatArray, half_width: FloatArray, wide: np.ndarray) -> Interval:
    return Interval(np.where(wide, np.nan, value), np.where(wide, np.nan, half_width))


def _named(names: tuple[str, ...], half_width: FloatArray) -> list[str]:
    return [name for name, half in zip(names, half_width, strict=True) if np.isnan(half)]
