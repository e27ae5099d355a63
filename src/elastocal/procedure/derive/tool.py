"""The tool's weight: removed from each reading, estimated from a run, and tested for a change.

The sensor's equations, from reading to wrench on the robot, are in `elastocal.cell.sensor`, which
the compensator uses, too. The unloaded reference of the same pose is the tare: at almost the same
orientation it removes bias and weight; the cell file's mass removes the small change of the
weight's direction between the two.

`estimate_tool` finds mass, centre of mass, bias and drift by the unloaded references of a run. With
a bias that drifts linearly they are linear in the mass, ``h = mass c``, biases and drifts:

    F_i = R_i^T g mass + b + d (t_i - t_mean),
    M_i = -[R_i^T g]x h + b_m + d_m (t_i - t_mean).

Ordinary least squares with intervals by Student's t; undetermined values are NaN, and named. The
error of a sensor by cross-talk and gain turns with the tool as its weight does, so no residual
shows it; the intervals include it, with an assumed error of each entry of the matrix of a hundredth
of the ranges of its axes. `tool_change` tests whether one mass fits the whole run: a step at some
reading is one more unknown; the best reading is the one that reduces the sum of squares most, and
an F test, corrected for the number of readings, decides on its significance.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import fdtrc, stdtrit

from elastocal.arrays import FloatArray
from elastocal.cell import Cell, SensorLoad
from elastocal.errors import ProcedureError
from elastocal.results import brief_repr
from elastocal.robot import inverse_transform


@brief_repr
@dataclass(frozen=True, eq=False)
class RawWrench:
    """Mean raw wrench at one place of the tool."""

    force: FloatArray
    """Sensor frame, shape (3,), in N."""
    moment: FloatArray
    """Sensor frame, about its origin, shape (3,), in N·m."""
    T_base_tcp: FloatArray
    """Tool frame then, shape (4, 4), in m."""


@brief_repr
@dataclass(frozen=True, eq=False)
class RobotWrench:
    """Wrench on the robot at the tool centre point, in base."""

    force: FloatArray
    """Shape (3,), in N."""
    moment: FloatArray
    """About the tool centre point, shape (3,), in N·m."""


def sensor_load(cell: Cell) -> SensorLoad:
    """Return the tool on its sensor as the cell file states it.

    Raises
    ------
    ProcedureError
        If the cell has no sensor.
    """
    sensor, T_sensor_tcp = cell.file.sensor, cell.T_sensor_tcp
    if sensor is None or T_sensor_tcp is None:
        raise ProcedureError(f"cell {cell.name!r} has no force sensor (key 'sensor')")
    T_sensor_flange = inverse_transform(sensor.T_flange_sensor)
    centre = T_sensor_flange[:3, :3] @ cell.file.tool.centre + T_sensor_flange[:3, 3]
    mass = cell.file.tool.mass
    T = inverse_transform(T_sensor_tcp)
    return SensorLoad(mass, centre, T_tcp_sensor=T, gravity=cell.gravity_base)


def wrench_on_robot(loaded: RawWrench, tare: RawWrench, sensor: SensorLoad) -> RobotWrench:
    """Return the press on the robot, tool weight and bias removed.

    ``[f; t] = D (y - y_tare) - K (g - g_tare)``, with the sensor's matrix ``D`` and its response
    ``K`` to gravity ``g``; see `elastocal.cell.sensor`.

    Parameters
    ----------
    loaded : RawWrench
        Under load.
    tare : RawWrench
        Unloaded, at the same pose.
    sensor : SensorLoad
        Its matrix, the tool's weight on it, and its place.
    """
    R, R_tare = sensor.R_base_sensor(loaded.T_base_tcp), sensor.R_base_sensor(tare.T_base_tcp)
    change = np.concatenate([loaded.force - tare.force, loaded.moment - tare.moment])
    wrench = sensor.matrix @ change - (sensor.weight(R) - sensor.weight(R_tare))
    force, moment = R @ wrench[:3], R @ wrench[3:]
    arm = loaded.T_base_tcp[:3, :3] @ sensor.T_tcp_sensor[:3, 3]
    return RobotWrench(force, moment + np.cross(arm, force))


def turned_sigma(R: FloatArray, *sigmas: FloatArray) -> FloatArray:
    """Return the standard deviations of a sum or difference of vectors in other axes.

    Parameters
    ----------
    R : ndarray, shape (3, 3)
        Rotation into these axes.
    *sigmas : ndarray, shape (3,)
        Standard deviations of the components of each vector, taken as independent.
    """
    return np.sqrt(R**2 @ sum(sigma**2 for sigma in sigmas))


_CROSS_TALK = 0.01
"""Standard deviation of an entry of a sensor's matrix, in the ranges of its axes: what data sheets
of six-axis sensors allow. `elastocal tool`, which estimates the matrix too, takes the same."""
_SURE = 4.0
"""Standard deviations of what cross-talk makes of a step, up to which it may be cross-talk."""
_CHANCE_OF_STEP = 1e-4
"""Probability of a step that is only chance, over all places, below which it is believed."""
_SHARE = 0.05
"""Smallest step that is warned of, as a share of the tool's mass."""


@dataclass(frozen=True)
class ToolChange:
    """A step of the tool's mass."""

    reading: int
    """First unloaded reading with the new mass, from 0."""
    mass: float
    """Change, in kg."""


def tool_change(
    blocks: FloatArray,
    force: FloatArray,
    gravity: FloatArray,
    nominal_mass: float,
    misread: FloatArray | None = None,
) -> ToolChange | None:
    """Return the step of the mass that the unloaded readings show; None: one mass fits them all.

    Parameters
    ----------
    blocks : ndarray, shape (reading, 3, unknown)
        Equations of the forces with one mass.
    force : ndarray, shape (reading, 3)
        Sensor frame, in N.
    gravity : ndarray, shape (reading, 3)
        In the sensor's axes, in m/s².
    nominal_mass : float
        Mass of the tool by the cell file, in kg.
    misread : ndarray, shape (entry, row), optional
        What each entry of the sensor's matrix may add to all components, in N.
    """
    count, free = len(force), force.size - blocks.shape[2] - 1
    if free < 1:
        return None
    A, b = blocks.reshape(force.size, -1), force.ravel()
    u, s, _ = np.linalg.svd(A / np.maximum(np.linalg.norm(A, axis=0), 1e-300), full_matrices=False)
    basis = u[:, s > _DEPENDENT * s[0]]
    after = np.arange(count)[:, None] >= np.arange(1, count)
    steps = (gravity[:, :, None] * after[:, None, :]).reshape(force.size, -1)
    own = steps - basis @ (basis.T @ steps)
    left = b - basis @ (basis.T @ b)
    squares = (own**2).sum(axis=0)
    own_part = squares > _DEPENDENT * (steps**2).sum(axis=0)
    change = np.where(own_part, own.T @ left / np.where(own_part, squares, 1.0), 0.0)
    gain = change**2 * squares
    best = int(np.argmax(gain))
    rest = max(float(left @ left - gain[best]), np.finfo(float).tiny)
    chance = (count - 1) * fdtrc(1, free, gain[best] / (rest / free))
    doubt = 0.0 if misread is None else float(np.linalg.norm(misread @ own[:, best]))
    least = max(_SHARE * nominal_mass, _SURE * doubt / max(squares[best], np.finfo(float).tiny))
    if not (chance < _CHANCE_OF_STEP and abs(change[best]) > least):
        return None
    return ToolChange(best + 1, float(change[best]))


_LEVEL = 0.95
"""Probability of the intervals."""
_WIDE_MASS = 0.2
"""Half interval of the mass, as a share of it, beyond which it counts as not determined."""
_WIDE_CENTRE = 0.05
"""Half interval of a coordinate of the centre of mass beyond which it is not determined, in m."""
_DEPENDENT = 1e-8
"""Ratio of singular values, columns scaled, below which columns depend on one another."""

_NAMES = ("mass", *(f"{what} {axis}" for what in ("force bias", "force drift") for axis in "xyz"))
_MOMENT_NAMES = tuple(
    f"{what} {axis}" for what in ("centre of mass", "moment bias", "moment drift") for axis in "xyz"
)


@brief_repr
@dataclass(frozen=True, eq=False)
class UnloadedWrenches:
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


@brief_repr
@dataclass(frozen=True, eq=False)
class Interval:
    """An estimate with the half width of its 95 % interval; both NaN where not determined."""

    value: FloatArray
    half_width: FloatArray


@brief_repr
@dataclass(frozen=True, eq=False)
class ToolEstimate:
    """Tool and sensor by the unloaded references of a run."""

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
    """Names of the unknowns that orientations and times do not determine."""
    change: ToolChange | None = None
    """Set where one mass does not fit the whole run: mass, centre and biases are then those of no
    tool."""


def estimate_tool(
    unloaded: UnloadedWrenches, nominal_mass: float, ranges: FloatArray | None = None
) -> ToolEstimate:
    """Return tool and sensor as the unloaded references show them.

    Parameters
    ----------
    unloaded : UnloadedWrenches
        May be empty; with few or similar orientations little is determined.
    nominal_mass : float
        Mass of the tool by the cell file, in kg: the scale of what is too wide, and the divisor
        of the centre of mass where the mass is not determined.
    ranges : ndarray, shape (6,), optional
        Largest forces and moments of the sensor, in N and N·m; without them it has no cross-talk.
    """
    time = unloaded.time - unloaded.time.mean() if len(unloaded.time) else unloaded.time
    gravity = unloaded.gravity @ unloaded.R_base_sensor
    eye = np.broadcast_to(np.eye(3), (len(time), 3, 3))
    drift = eye * time[:, None, None]
    blocks = np.concatenate([gravity[:, :, None], eye, drift], axis=2)
    force = _solve(blocks, unloaded.force)
    turn = np.cross(np.eye(3)[None], gravity[:, None, :]).swapaxes(1, 2)
    moment = _solve(np.concatenate([turn, eye, drift], axis=2), unloaded.moment)
    misread = None
    if ranges is not None:
        weight = np.hstack([nominal_mass * gravity, turn @ np.nan_to_num(moment.value[:3])])
        misread = _CROSS_TALK * _misreadings(weight, ranges)
        force, moment = force.doubted(misread[0]), moment.doubted(misread[1])
    wide_mass = not force.half_width[0] <= _WIDE_MASS * max(nominal_mass, 1.0)
    mass = nominal_mass if wide_mass else max(float(force.value[0]), _WIDE_MASS * nominal_mass)
    centre = Interval(moment.value[:3] / mass, moment.half_width[:3] / mass)
    wide_centre = ~(centre.half_width <= _WIDE_CENTRE)
    unknown = [*_named(_NAMES, force.half_width), *_named(_MOMENT_NAMES, moment.half_width)]
    unknown += ["mass"] * wide_mass
    unknown += [_MOMENT_NAMES[axis] for axis in np.flatnonzero(wide_centre)]
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
        change=tool_change(
            blocks, unloaded.force, gravity, nominal_mass, None if misread is None else misread[0]
        ),
    )


def _misreadings(weight: FloatArray, ranges: FloatArray) -> FloatArray:
    """Return the effect of each entry of a sensor's matrix on the tool's weight and its moment.

    Shape (2, entry, row), per part of the ranges; ``weight`` has forces and moments, shape
    (reading, 6).
    """
    scale = np.divide.outer(ranges, ranges).reshape(2, 3, 6)
    entries = np.einsum("skl,rl,ka->sklra", scale, weight, np.eye(3))
    return np.asarray(entries.reshape(2, 18, -1))


@dataclass(frozen=True, eq=False)
class _Solution(Interval):
    scatter: float
    inverse: FloatArray
    """Matrix from readings to the solution, shape (unknown, row)."""
    free: int

    def doubted(self, misread: FloatArray) -> "_Solution":
        """Return the solution with intervals that hold errors of unit size too, (error, row)."""
        sigma = np.linalg.norm(self.inverse @ misread.T, axis=1)
        width = np.hypot(self.half_width, stdtrit(max(self.free, 1), 0.5 + _LEVEL / 2) * sigma)
        return replace(self, half_width=width)


def _solve(blocks: FloatArray, readings: FloatArray) -> _Solution:
    """Return the least-squares solution of stacked blocks, shape (reading, 3, unknown)."""
    unknowns = blocks.shape[2]
    A, b = blocks.reshape(-1, unknowns), readings.ravel()
    free = len(b) - unknowns
    nothing = np.full(unknowns, np.nan)
    if free < 1:
        return _Solution(nothing, nothing, float("nan"), np.zeros(A.T.shape), free)
    scale = np.linalg.norm(A, axis=0)
    scale[scale == 0] = 1.0
    u, s, vt = np.linalg.svd(A / scale, full_matrices=False)
    kept = s > _DEPENDENT * s[0]
    inverse = (vt[kept].T / s[kept]) @ u[:, kept].T / scale[:, None]
    value = inverse @ b
    left = b - A @ value
    scatter = float(np.sqrt(left @ left / (free + int((~kept).sum()))))
    sigma = scatter * np.sqrt(((vt[kept] / s[kept, None]) ** 2).sum(axis=0)) / scale
    half = stdtrit(free, 0.5 + _LEVEL / 2) * sigma
    loose = np.linalg.norm(vt[~kept], axis=0) > np.sqrt(_DEPENDENT)
    value, half = (np.where(loose, np.nan, each) for each in (value, half))
    return _Solution(value, half, scatter, inverse, free)


def _part(solution: _Solution, start: int) -> Interval:
    rows = slice(start, start + 3)
    return Interval(solution.value[rows], solution.half_width[rows])


def _masked(value: FloatArray, half_width: FloatArray, wide: np.ndarray) -> Interval:
    return Interval(np.where(wide, np.nan, value), np.where(wide, np.nan, half_width))


def _named(names: tuple[str, ...], half_width: FloatArray) -> list[str]:
    return [name for name, half in zip(names, half_width, strict=True) if np.isnan(half)]
