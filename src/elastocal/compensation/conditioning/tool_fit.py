"""Tool weight, centre of mass, sensor bias and sensor rotation from static postures.

With gravity ``u_i`` in the flange's axes, the rotation ``R`` of the sensor in the flange and
``h = mass c``, a sensor that carries nothing but its tool reads

    F_i = mass R^T u_i + b,        M_i = h x R^T u_i + b_m.

Thirteen unknowns: mass, a small rotation, ``b``, ``h``, ``b_m``. Gauss-Newton from the best
rotation between forces and gravity (Kabsch 1976), with singular directions left where they
started; force and moment are weighed by their own scatter. The intervals are those of the last
linear step, by Student's t. This extends `elastocal.procedure.derive.tool`, which knows the
rotation and looks for drift instead.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.special import stdtrit

from elastocal.arrays import BoolArray, FloatArray
from elastocal.compensation.conditioning.postures import StaticPostures
from elastocal.results import brief_repr

TOOL_UNKNOWNS = (
    "mass",
    *(f"sensor rotation about {axis}" for axis in "xyz"),
    *(f"force bias {axis}" for axis in "xyz"),
    *(f"centre of mass {axis}" for axis in "xyz"),
    *(f"moment bias {axis}" for axis in "xyz"),
)
"""The unknowns, in the order of every vector of them; in place of the centre of mass itself the
vectors hold mass times centre."""
_ROTATION = slice(1, 4)
_LEVEL = 0.95
"""Confidence level of the intervals."""
_DEPENDENT = 1e-6
"""Ratio of singular values, columns scaled, below which unknowns depend on one another."""
_LOADING = 1e-3
"""Part of an unknown in a dependent direction from which on it counts as not determined."""
_STEPS = 30
_DONE = 1e-13
_NO_MASS = 1e-9
"""In kg; what divides by the mass divides by no less."""
_WIDE_MASS = 0.2
"""Half interval of the mass, as a share of it, beyond which it counts as not determined."""
_WIDE_ROTATION = np.radians(5.0)
"""Half interval of a rotation beyond which it is not determined, in rad."""
_WIDE_CENTRE = 0.05
"""Half interval of a coordinate of the centre of mass beyond which it is not, in m."""
_WIDE_BIAS = 0.2
"""Half interval of a bias, as a share of the weight (of weight times 0.1 m), beyond which."""


def tool_wrenches(postures: StaticPostures, values: FloatArray, R: FloatArray) -> FloatArray:
    """Return forces and moments, shape (posture, 6)."""
    u = postures.gravity_flange @ R
    force = values[0] * u + values[4:7]
    return np.hstack([force, np.cross(values[7:10], u) + values[10:13]])


def tool_derivatives(postures: StaticPostures, values: FloatArray, R: FloatArray) -> FloatArray:
    """Return the derivatives of `tool_wrenches`, shape (posture, 6, 13).

    They are by mass, rotation (in sensor axes), b, h and b_m.
    """
    u = postures.gravity_flange @ R
    J = np.zeros((len(u), 6, len(TOOL_UNKNOWNS)))
    skew_u = _skew(u)
    J[:, :3, 0] = u
    J[:, :3, _ROTATION] = values[0] * skew_u
    J[:, :3, 4:7] = np.eye(3)
    J[:, 3:, _ROTATION] = _skew(values[7:10]) @ skew_u
    J[:, 3:, 7:10] = -skew_u
    J[:, 3:, 10:13] = np.eye(3)
    return J


def _skew(v: FloatArray) -> FloatArray:
    """Return ``[v]x`` with ``[v]x a = v x a``."""
    S = np.zeros((*v.shape[:-1], 3, 3))
    S[..., 0, 1], S[..., 0, 2] = -v[..., 2], v[..., 1]
    S[..., 1, 0], S[..., 1, 2] = v[..., 2], -v[..., 0]
    S[..., 2, 0], S[..., 2, 1] = -v[..., 1], v[..., 0]
    return S


@brief_repr
@dataclass(frozen=True, eq=False)
class ToolFit:
    """Tool and sensor, as static postures show them."""

    mass: float
    """In kg."""
    centre: FloatArray
    """Centre of mass in the sensor's frame, shape (3,), in m."""
    force_bias: FloatArray
    """Shape (3,), in N."""
    moment_bias: FloatArray
    """Shape (3,), in N·m."""
    R_flange_sensor: FloatArray
    """Shape (3, 3)."""
    half_width: dict[str, float]
    """Half the 95 % interval of each of `TOOL_UNKNOWNS`: kg, rad, N, m, N·m; NaN where not
    determined, 0 for a rotation that was taken as known."""
    undetermined: tuple[str, ...]
    """Those of `TOOL_UNKNOWNS` that the postures do not determine; their values are where the fit
    began."""
    count: int
    """Postures."""
    force_scatter: float
    """Standard deviation of what is left of a force component, in N; NaN: nothing is left over."""
    moment_scatter: float
    """The same of the moment, in N·m."""
    rotation_known: bool = False
    """Whether the rotation was taken as it is."""


def fit_tool(
    postures: StaticPostures, R_nominal: FloatArray | None = None, rotation_known: bool = False
) -> ToolFit:
    """Return tool and sensor from static postures.

    Parameters
    ----------
    postures : StaticPostures
        At least three.
    R_nominal : ndarray, shape (3, 3), optional
        Rotation of the sensor in the flange as it was mounted; the identity by default. What the
        postures do not determine stays there.
    rotation_known : bool
        Take that rotation as it is.
    """
    nominal = np.eye(3) if R_nominal is None else R_nominal
    R = nominal if rotation_known else _rotation_between(postures, nominal)
    free = np.ones(len(TOOL_UNKNOWNS), dtype=bool)
    free[_ROTATION] = not rotation_known
    weights = np.ones(2)
    for _ in range(2):
        values, R = _descend(postures, R, free, weights)
        scatter = _scatter(postures, values, R, free)
        weights = (
            1.0 / np.where(scatter > 0.0, scatter, 1.0) if np.all(np.isfinite(scatter)) else weights
        )
    return _result(postures, values, R, free, weights, scatter)


def tool_residual(postures: StaticPostures, fit: ToolFit) -> tuple[FloatArray, FloatArray]:
    """Return what a fit leaves of forces and moments, shapes (posture, 3)."""
    weight = fit.mass * (postures.gravity_flange @ fit.R_flange_sensor)
    return (
        postures.force - weight - fit.force_bias,
        postures.moment - np.cross(fit.centre, weight) - fit.moment_bias,
    )


def _rotation_between(postures: StaticPostures, nominal: FloatArray) -> FloatArray:
    """Return the rotation that best turns gravity into forces, the nominal one where open."""
    u = postures.gravity_flange - postures.gravity_flange.mean(axis=0)
    F = postures.force - postures.force.mean(axis=0)
    U, s, Vt = np.linalg.svd(u.T @ F)
    if not s[1] > _LOADING * max(s[0], np.finfo(float).tiny):
        return nominal
    turn = np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))])
    rotation: FloatArray = U @ turn @ Vt
    return rotation


def _descend(
    postures: StaticPostures, R: FloatArray, free: BoolArray, weights: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return values (rotation 0, about the R returned) of the least squares."""
    values = np.zeros(len(TOOL_UNKNOWNS))
    measured = np.hstack([postures.force, postures.moment])
    for _ in range(_STEPS):
        left = (measured - tool_wrenches(postures, values, R)) * np.repeat(weights, 3)
        u, s, vt, scale, kept = _decomposed(tool_derivatives(postures, values, R), free, weights)
        step = np.zeros(len(TOOL_UNKNOWNS))
        step[free] = (vt[kept].T @ ((u[:, kept].T @ left.ravel()) / s[kept])) / scale
        values = values + step
        R = R @ Rotation.from_rotvec(step[_ROTATION]).as_matrix()
        values[_ROTATION] = 0.0
        if np.abs(step).max() <= _DONE * max(1.0, float(np.abs(values).max())):
            break
    return values, R


def _decomposed(
    derivatives: FloatArray, free: BoolArray, weights: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, BoolArray]:
    """Return the singular value decomposition ``u s vt`` of the weighed derivatives.

    Before it the columns of the free unknowns are divided by their ``scale``; the last array tells
    the directions that the postures determine.
    """
    J = (derivatives * np.repeat(weights, 3)[:, None]).reshape(-1, len(TOOL_UNKNOWNS))[:, free]
    scale = np.linalg.norm(J, axis=0)
    scale[scale <= _DEPENDENT * scale.max()] = scale.max()
    u, s, vt = np.linalg.svd(J / scale, full_matrices=False)
    return u, s, vt, scale, s > _DEPENDENT * s[0]


def _scatter(
    postures: StaticPostures, values: FloatArray, R: FloatArray, free: BoolArray
) -> FloatArray:
    """Return the standard deviations of what is left of force and moment components."""
    left = np.hstack([postures.force, postures.moment]) - tool_wrenches(postures, values, R)
    rows = 3 * len(postures)
    over = rows - np.array([4 + 3 * bool(free[1]), 6])
    squares = (left.reshape(-1, 2, 3) ** 2).sum(axis=(0, 2))
    return np.where(over > 0, np.sqrt(squares / np.maximum(over, 1)), np.nan)


def _result(
    postures: StaticPostures,
    values: FloatArray,
    R: FloatArray,
    free: BoolArray,
    weights: FloatArray,
    scatter: FloatArray,
) -> ToolFit:
    _, s, vt, scale, kept = _decomposed(tool_derivatives(postures, values, R), free, weights)
    mass = float(values[0])
    centre = values[7:10] / (mass if abs(mass) > 0.0 else np.inf)
    # Rows: how each unknown moves with the independent directions, each by its deviation.
    moves = np.zeros((len(TOOL_UNKNOWNS), int(kept.sum())))
    moves[free] = (vt[kept] / s[kept, None]).T / scale[:, None]
    moves[7:10] = (moves[7:10] - centre[:, None] * moves[0]) / max(abs(mass), _NO_MASS)
    sigma = np.linalg.norm(moves, axis=1)
    # Columns that are weighed have scatter 1; those that are not have what is left of them.
    unit = 1.0 if np.all(scatter > 0.0) else float(np.nan_to_num(scatter).max())
    degrees = 6 * len(postures) - int(free.sum())
    half = stdtrit(max(degrees, 1), 0.5 + _LEVEL / 2) * sigma * unit
    loose = np.zeros(len(TOOL_UNKNOWNS), dtype=bool)
    loose[free] = np.linalg.norm(vt[~kept], axis=0) > _LOADING
    if degrees < 1:
        half[:] = np.nan
    loose |= ~(half <= _widest(mass, postures))
    half[loose] = np.nan
    return ToolFit(
        mass=mass,
        centre=centre,
        force_bias=values[4:7],
        moment_bias=values[10:13],
        R_flange_sensor=R,
        half_width=dict(zip(TOOL_UNKNOWNS, half.tolist(), strict=True)),
        undetermined=tuple(name for name, open_ in zip(TOOL_UNKNOWNS, loose, strict=True) if open_),
        count=len(postures),
        force_scatter=float(scatter[0]),
        moment_scatter=float(scatter[1]),
        rotation_known=not free[1],
    )


def _widest(mass: float, postures: StaticPostures) -> FloatArray:
    """Return the half widths beyond which an unknown counts as not determined."""
    weight = abs(mass) * float(np.linalg.norm(postures.gravity))
    widest = [_WIDE_ROTATION, _WIDE_BIAS * weight, _WIDE_CENTRE, _WIDE_BIAS * weight * 0.1]
    return np.array([_WIDE_MASS * abs(mass), *np.repeat(widest, 3)])
