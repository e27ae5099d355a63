"""Least squares of stations, lever arm and robot errors (Gauss-Newton).

Reading ``i`` of a group ``g`` (a station between two moves) satisfies

    R_g p_i + t_g = p_tcp,i + R_tcp,i r + B_i b,

with the marker ``p_i`` in the tracker's frame, the lever arm ``r`` and the robot's own errors ``b``
(offsets of its joints, gravity sag), whose effects on the marker are the columns of ``B_i``. ``r``
has the cell file's value as a weak prior, ``b`` has the prior 0 with standard deviation ``k``.
Without ``b`` those errors, smooth over the workspace, would look like stations that move. Their
size ``k`` and the size ``s`` of the unstructured scatter are estimated from the readings, by the
maximum of the restricted likelihood of the residuals (Patterson and Thompson 1971), with weak
priors that decide for few poses.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.results import brief_repr
from elastocal.robot import nearest_rotation


@brief_repr
@dataclass(frozen=True, eq=False)
class UnloadedReadings:
    """Marker and controller at every pose before it was loaded, in the order of time."""

    pose: IndexArray
    """Ids, shape (reading,)."""
    station: tuple[str, ...]
    """Station that measured."""
    position: FloatArray
    """Marker in the frame of its station, shape (reading, 3), in m."""
    sigma: FloatArray
    """Standard deviation of it, shape (reading,), in m; NaN counts as 0."""
    T_base_tcp: FloatArray
    """Tool frame of the controller, shape (reading, 4, 4), in m."""
    robot_error: FloatArray
    """Displacement of the marker by one standard deviation of each error that a robot is
    thought to have, shape (reading, 3, error), in m; no columns: a perfect robot."""

    def __len__(self) -> int:
        """Return the number of readings."""
        return len(self.pose)

    def take(self, rows: IndexArray) -> "UnloadedReadings":
        """Return some readings, in the order of ``rows``."""
        return UnloadedReadings(
            self.pose[rows],
            tuple(self.station[row] for row in rows),
            self.position[rows],
            self.sigma[rows],
            self.T_base_tcp[rows],
            self.robot_error[rows],
        )

    def expected(self, lever: FloatArray) -> FloatArray:
        """Return the marker's position by the controller, in base, shape (reading, 3), in m."""
        T = self.T_base_tcp
        return T[:, :3, 3] + T[:, :3, :3] @ lever

    @property
    def variance(self) -> FloatArray:
        """Variance of a coordinate of each reading, shape (reading,), in m²."""
        return np.nan_to_num(self.sigma, nan=0.0) ** 2


_ROTATION_SIGMA = 0.02
"""Largest usable standard deviation of a rotation, in rad: it gives a displacement of 1 mm an error
of 20 µm, as much as a tracker's own noise."""


def determined(position: FloatArray, scatter: float) -> bool:
    """Return whether points determine a rotation well enough.

    Points on a line leave the rotation about it free; how far they are off their best line
    bounds its standard deviation.

    Parameters
    ----------
    position : ndarray, shape (point, 3)
        In any frame, in m.
    scatter : float
        Standard deviation of a coordinate, in m.
    """
    return rotation_sigma(position, scatter) <= _ROTATION_SIGMA


def moments(position: FloatArray) -> FloatArray:
    """Return the summands of `determined_by` for each point, shape (point, 4, 4).

    Parameters
    ----------
    position : ndarray, shape (point, 3)
        In any frame, in m.
    """
    ones = np.column_stack([position - position.mean(axis=0), np.ones(len(position))])
    return np.asarray(ones[:, :, None] * ones[:, None, :])


def determined_by(sums: FloatArray) -> BoolArray:
    """Return whether points determine a rotation well enough, as `determined`, many sets at once.

    Parameters
    ----------
    sums : ndarray, shape (set, 4, 4)
        Sums of `moments`.
    """
    count = np.maximum(np.round(sums[:, 3, 3]), 1.0)[:, None]
    mean = sums[:, :3, 3] / count
    about = sums[:, :3, :3] - count[:, :, None] * mean[:, :, None] * mean[:, None, :]
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(about)[:, 1], 0.0))
    enough = spread * _ROTATION_SIGMA >= DEFAULT_SCATTER
    return np.asarray(enough & (count[:, 0] >= 3.0))


def align(here: FloatArray, there: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the rotation and translation that bring points nearest to others (Kabsch 1976).

    Parameters
    ----------
    here, there : ndarray, shape (point, 3)
        In m.
    """
    R = nearest_rotation((there - there.mean(axis=0)).T @ (here - here.mean(axis=0)))
    return R, there.mean(axis=0) - R @ here.mean(axis=0)


def rotation_sigma(position: FloatArray, scatter: float) -> float:
    """Return the standard deviation of the rotation about the points' own line, in rad."""
    if len(position) < 3:
        return math.inf
    spread = np.linalg.svd(position - position.mean(axis=0), compute_uv=False)
    return float(scatter / spread[1]) if spread[1] > 1e-6 else math.inf


LEVER_SIGMA = 5e-3
"""Standard deviation of the cell file's lever arm, in m: a ruler's reading on a probe holder."""
DEFAULT_SCATTER = 0.1e-3
"""Scatter of a coordinate by which poses are thought to determine a rotation or not, in m."""
_LIKELY = np.log([30e-6, 1.0])
"""Logarithms of the scatter in m and of the robot's errors over those that are thought likely."""
_FACTOR = np.log([3.0, 2.0])
"""Standard deviations of both: the readings have the last word where they are more than a few."""
_ROUNDS = 2
"""Times that scatter and errors are adapted to the residuals; they then are steady to a percent."""
_MOST_STEPS = 20
"""Gauss-Newton steps that are taken at most."""
_ARRIVED = 1e-12
"""Step in rad and m below which Gauss-Newton has arrived ..."""
_ERRORS_ARRIVED = 1e-9
"""... where those of the robot's errors, over their standard deviations, are below this one: each
moves the marker by about a millimetre, and smaller steps are round-off."""
_BOUNDS = [(math.log(1e-9), math.log(1e-2)), (math.log(0.05), math.log(20.0))]
"""Bounds of the two logarithms; weights need a scatter above zero."""
_FIRST_STEP = -0.4
"""First step of the search for them: down, away from the upper bounds."""


@dataclass(frozen=True, eq=False)
class Fit:
    """The minimum, with its linear equations: rows of the readings first, then the priors."""

    group: IndexArray
    """Group of each reading, shape (reading,)."""
    R: FloatArray
    """Rotation of each group, shape (group, 3, 3)."""
    t: FloatArray
    """Translation of each group, shape (group, 3), in m."""
    lever: FloatArray
    """Shape (3,), in m."""
    errors: FloatArray
    """Robot errors, over those that are thought likely, shape (error,)."""
    scatter: float
    """Scatter of a coordinate, tracker noise taken out, in m."""
    size: float
    """Standard deviation of the robot errors, over those thought likely."""
    weight: FloatArray
    """One over the standard deviation of each reading, shape (reading,), in 1/m."""
    A: FloatArray
    """Whitened, shape (row, unknown): per group 3 rotation (about the group's centre) and 3
    translation, 3 lever arm, then robot errors."""
    e: FloatArray
    """Residuals of the whitened rows, shape (row,)."""

    @property
    def covariance(self) -> FloatArray:
        """Covariance of the unknowns, shape (unknown, unknown)."""
        return np.asarray(np.linalg.pinv(self.A.T @ self.A, hermitian=True), dtype=float)

    @property
    def lever_columns(self) -> slice:
        """Columns of the lever arm."""
        start = 6 * len(self.R)
        return slice(start, start + 3)


def fit(readings: UnloadedReadings, group: IndexArray, lever_prior: FloatArray) -> Fit:
    """Return the fit of readings that are parted into groups.

    Parameters
    ----------
    readings : UnloadedReadings
        At least three, not on a line, in each group.
    group : ndarray of int, shape (reading,)
        Group of each reading, from 0 without gaps.
    lever_prior : ndarray, shape (3,)
        Marker in the tcp frame by the cell file, in m.
    """
    logs = _LIKELY
    for _ in range(_ROUNDS):
        result = _gauss_newton(readings, group, lever_prior, *np.exp(logs).tolist())
        logs = _likeliest(result, readings, logs)
    return _gauss_newton(readings, group, lever_prior, *np.exp(logs).tolist())


def motion_columns(centred: FloatArray) -> FloatArray:
    """Return the derivatives of points by a rotation about the centre and a shift, (point, 3, 6).

    Parameters
    ----------
    centred : ndarray, shape (point, 3)
        Points less their centre, in base, in m.
    """
    turned = np.cross(np.eye(3)[None], centred[:, None, :]).swapaxes(1, 2)
    return np.concatenate([turned, np.broadcast_to(np.eye(3), turned.shape)], axis=2)


def centred_points(R: FloatArray, position: FloatArray, group: IndexArray) -> FloatArray:
    """Return points in base axes less the centre of their group, shape (reading, 3), in m."""
    turned: FloatArray = np.einsum("nij,nj->ni", R[group], position)
    for number in range(len(R)):
        turned[group == number] -= turned[group == number].mean(axis=0)
    return turned


def _gauss_newton(
    readings: UnloadedReadings,
    group: IndexArray,
    lever_prior: FloatArray,
    scatter: float,
    size: float,
) -> Fit:
    weight = 1.0 / np.sqrt(readings.variance + scatter**2)
    # The unknowns of the robot are in units of their standard deviation.
    readings = replace(readings, robot_error=size * readings.robot_error)
    lever, errors = np.array(lever_prior), np.zeros(readings.robot_error.shape[2])
    R, t = _start(readings, group, lever)
    for _ in range(_MOST_STEPS):
        A = _equations(readings, group, R, weight)
        residual = _residual(readings, group, R, t, lever)
        e = _right_side(readings, residual, errors, weight, lever - lever_prior)
        step = np.asarray(-np.linalg.lstsq(A, e, rcond=None)[0], dtype=float)
        R, t = _moved(readings, group, R, t, step)
        lever, errors = lever + step[6 * len(R) :][:3], errors + step[6 * len(R) + 3 :]
        most = np.where(np.arange(len(step)) < 6 * len(R) + 3, _ARRIVED, _ERRORS_ARRIVED)
        if np.all(np.abs(step) < most):
            break
    residual = _residual(readings, group, R, t, lever)
    e = _right_side(readings, residual, errors, weight, lever - lever_prior)
    A = _equations(readings, group, R, weight)
    return Fit(group, R, t, lever, size * errors, scatter, size, weight, A, e)


def _start(
    readings: UnloadedReadings, group: IndexArray, lever: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return rotations and translations for a given lever arm."""
    expected = readings.expected(lever)
    members = [group == number for number in range(int(group.max()) + 1)]
    placed = [align(readings.position[mine], expected[mine]) for mine in members]
    return np.array([R for R, _ in placed]), np.array([t for _, t in placed])


def _residual(
    readings: UnloadedReadings, group: IndexArray, R: FloatArray, t: FloatArray, lever: FloatArray
) -> FloatArray:
    measured = np.einsum("nij,nj->ni", R[group], readings.position) + t[group]
    residual: FloatArray = measured - readings.expected(lever)
    return residual


def _right_side(
    readings: UnloadedReadings,
    residual: FloatArray,
    errors: FloatArray,
    weight: FloatArray,
    lever_change: FloatArray,
) -> FloatArray:
    left = (residual - readings.robot_error @ errors) * weight[:, None]
    return np.concatenate([left.ravel(), lever_change / LEVER_SIGMA, errors])


def _equations(
    readings: UnloadedReadings, group: IndexArray, R: FloatArray, weight: FloatArray
) -> FloatArray:
    count, groups, errors = len(readings), len(R), readings.robot_error.shape[2]
    A = np.zeros((count, 3, 6 * groups + 3 + errors))
    motion = motion_columns(centred_points(R, readings.position, group))
    for number in range(groups):
        mine = group == number
        A[mine, :, 6 * number : 6 * number + 6] = motion[mine]
    A[:, :, 6 * groups : 6 * groups + 3] = -readings.T_base_tcp[:, :3, :3]
    A[:, :, 6 * groups + 3 :] = -readings.robot_error
    A *= weight[:, None, None]
    priors = np.eye(3 + errors, 6 * groups + 3 + errors, k=6 * groups)
    priors[:3] /= LEVER_SIGMA
    return np.vstack([A.reshape(3 * count, -1), priors])


def _moved(
    readings: UnloadedReadings, group: IndexArray, R: FloatArray, t: FloatArray, step: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return rotations and translations after a step that turns each group about its centre."""
    turns, shifts = step[: 6 * len(R)].reshape(-1, 2, 3).swapaxes(0, 1)
    centre = np.array([readings.position[group == number].mean(0) for number in range(len(R))])
    place = np.einsum("gij,gj->gi", R, centre) + t + shifts
    new = Rotation.from_rotvec(turns).as_matrix() @ R
    return new, place - np.einsum("gij,gj->gi", new, centre)


def _likeliest(result: Fit, readings: UnloadedReadings, start: FloatArray) -> FloatArray:
    """Return logarithms of the scatter in m and of the size of the errors, shape (2,).

    With the unknowns ``x`` integrated over, those of the stations without a prior, twice the
    negative logarithm of the likelihood is, but for a constant,

        3 sum log v - log det P + log det (G + P) + min |e + A x|²,

    with the variance ``v`` of a coordinate of each reading, the equations weighed by it, ``G`` the
    products of their columns and ``P`` the priors' weights.
    """
    from scipy.optimize import minimize

    rows, errors = 3 * len(readings), readings.robot_error.shape[2]
    free = 6 * len(result.R)
    plain = np.repeat(1.0 / result.weight, 3)[:, None]
    columns = plain * np.column_stack([result.A[:rows], result.e[:rows]])
    columns[:, free + 3 : free + 3 + errors] /= result.size
    # Priors count from their own means, not from the present state of the fit.
    off = np.zeros(columns.shape[1] - 1)
    off[free : free + 3] = result.e[rows : rows + 3] * LEVER_SIGMA
    off[free + 3 :] = result.errors
    columns[:, -1] -= columns[:, :-1] @ off

    seen, own = readings.variance, np.arange(free, columns.shape[1] - 1)

    def minus_twice_log(logs: FloatArray) -> float:
        scatter, size = np.exp(logs)
        variance = seen + scatter**2
        M = columns.T @ (columns / np.repeat(variance, 3)[:, None])
        prior = np.concatenate([np.full(3, LEVER_SIGMA**-2), np.full(errors, size**-2)])
        M[own, own] += prior
        # With the right-hand side as last column the last pivot is the root of what is left, of
        # nothing, too: a one is added to its square.
        M[-1, -1] += 1.0
        pivots = np.linalg.cholesky(M).diagonal()
        value = 3.0 * np.log(variance).sum() - np.log(prior).sum()
        value += 2.0 * np.log(pivots[:-1]).sum() + pivots[-1] ** 2 - 1.0
        return float(value + (((logs - _LIKELY) / _FACTOR) ** 2).sum())

    # SciPy's own first simplex is a share of the start, and log 1 is 0: it would be a line.
    simplex = start + _FIRST_STEP * np.eye(3, 2, k=-1)
    found = minimize(
        minus_twice_log,
        start,
        method="Nelder-Mead",
        bounds=_BOUNDS,
        options={"xatol": 0.01, "initial_simplex": simplex},
    )
    return np.asarray(found.x, dtype=float)
