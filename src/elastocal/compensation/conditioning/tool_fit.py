"""Tool weight, centre of mass, sensor bias, drift, matrix and rotation from static postures.

With gravity ``u_i`` in the flange's axes, the rotation ``R`` of the sensor in the flange and
``h = mass c``, a sensor that carries nothing but its tool reads

    y_i = (1 + X) [mass R^T u_i; h x R^T u_i] + [b; b_m] + s_i d,        s_i from -1/2 to 1/2.

Mass, ``h`` and the biases are always free. The rotation ``R`` is known from the drawing, unless
asked for; drift ``d`` and matrix ``X`` (gains, cross-talk) are added where left-out postures
support them (`elastocal.compensation.conditioning.tool_choice`). ``X`` has a prior: every entry is
normal about 0, with the sensor's cross-talk as its deviation, in units of its ranges. Without one
it would absorb everything: a rotation by a small angle is a matrix, too, and static postures
distinguish neither the two, nor mass from gain. A weight excites three directions of the six of a
wrench (``[1; [c]x]``): 18 of the 36 entries' combinations at most.

Gauss-Newton from the best rotation between forces and gravity (Kabsch 1976), with singular
directions kept at their start; force and moment are weighted by their own scatter. The intervals
are those of the last linear step with the prior as further rows, by Student's t.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.special import stdtrit

from elastocal.arrays import BoolArray, FloatArray
from elastocal.compensation.conditioning.postures import StaticPostures
from elastocal.results import brief_repr
from elastocal.robot import nearest_rotation

TOOL_UNKNOWNS = (
    "mass",
    *(f"sensor rotation about {axis}" for axis in "xyz"),
    *(f"force bias {axis}" for axis in "xyz"),
    *(f"centre of mass {axis}" for axis in "xyz"),
    *(f"moment bias {axis}" for axis in "xyz"),
)
"""The unknowns, in the order of every vector of them; in place of the centre of mass itself the
vectors hold mass times centre."""
_PLAIN = len(TOOL_UNKNOWNS)
_ROTATION, _DRIFT, _MATRIX = slice(1, 4), slice(_PLAIN, _PLAIN + 6), slice(_PLAIN + 6, _PLAIN + 42)
_ALL = _PLAIN + 42
_LEVEL = 0.95
"""Confidence level of the intervals."""
_DEPENDENT = 1e-6
"""Ratio of singular values, columns scaled, below which unknowns depend on one another."""
_LOADING = 1e-3
"""Part of an unknown in a dependent direction from which on it counts as not determined."""
_STEPS = 30
_DONE = 1e-11
_NO_MASS = 1e-9
"""Smallest mass by which a number is divided, in kg."""
_ROUNDING = 1e-9
"""Least scatter, as a share of the readings' size: what is exact is not weighed endlessly."""
_WIDE_MASS = 0.2
"""Half interval of the mass, as a share of it, beyond which it counts as not determined."""
_WIDE_ROTATION = np.radians(5.0)
"""Half interval of a rotation beyond which it is not determined, in rad."""
_WIDE_CENTRE = 0.05
"""Half interval of a coordinate of the centre of mass beyond which it is not, in m."""
_WIDE_BIAS = 0.2
"""Half interval of a bias, as a share of the weight (of weight times 0.1 m), beyond which."""


@brief_repr
@dataclass(frozen=True)
class ToolModel:
    """Unknowns that are free beside mass, centre of mass and biases."""

    rotation: bool = False
    """The rotation of the sensor in the flange."""
    drift: bool = False
    """A drift of the biases, linear from the first posture to the last."""
    cross_talk: float = 0.0
    """Deviation of the matrix's entries before anything is measured, of the ranges; 0: none."""
    lever: float = 0.1
    """The sensor's moment range over its force range, in m."""

    @property
    def free(self) -> BoolArray:
        """Mask of the free unknowns, shape (55,): those of a tool, drift, matrix."""
        free = np.ones(_ALL, dtype=bool)
        free[_ROTATION], free[_DRIFT], free[_MATRIX] = self.rotation, self.drift, self.has_matrix
        return free

    @property
    def has_matrix(self) -> bool:
        """Whether the matrix is free."""
        return self.cross_talk > 0.0

    @property
    def spread(self) -> FloatArray:
        """Deviation of the matrix's entries by the prior, shape (6, 6)."""
        scale = np.repeat([1.0, self.lever], 3)
        spread: FloatArray = self.cross_talk * np.divide.outer(scale, scale)
        return spread

    @property
    def name(self) -> str:
        """The free unknowns, in words."""
        parts = ("rotation", self.rotation), ("drift", self.drift), ("matrix", self.has_matrix)
        return " + ".join(["tool and bias", *(part for part, free in parts if free)])


def tool_wrenches(
    postures: StaticPostures, values: FloatArray, R: FloatArray, model: ToolModel | None = None
) -> FloatArray:
    """Return forces and moments, shape (posture, 6).

    ``values`` holds mass, rotation (ignored: it is in ``R``), b, h, b_m, and with a model the drift
    and the matrix by rows, in deviations of its prior.
    """
    u = postures.gravity_flange @ R
    wrench = np.hstack([values[0] * u, np.cross(values[7:10], u)])
    found: FloatArray = wrench + np.concatenate([values[4:7], values[10:13]])
    if model is not None:
        X = values[_MATRIX].reshape(6, 6) * model.spread
        found = found + wrench @ X.T + postures.course[:, None] * values[_DRIFT]
    return found


def tool_derivatives(
    postures: StaticPostures, values: FloatArray, R: FloatArray, model: ToolModel | None = None
) -> FloatArray:
    """Return the derivatives of `tool_wrenches`, shape (posture, 6, 13), with a model (..., 55).

    They are by mass, rotation (in sensor axes), b, h, b_m, drift and matrix.
    """
    u = postures.gravity_flange @ R
    n = len(u)
    J = np.zeros((n, 6, _PLAIN if model is None else _ALL))
    skew_u = _skew(u)
    J[:, :3, 0] = u
    J[:, :3, _ROTATION] = values[0] * skew_u
    J[:, 3:, _ROTATION] = _skew(values[7:10]) @ skew_u
    J[:, 3:, 7:10] = -skew_u
    if model is not None:
        wrench = np.hstack([values[0] * u, np.cross(values[7:10], u)])
        J[:, :, :_PLAIN] += (values[_MATRIX].reshape(6, 6) * model.spread) @ J[:, :, :_PLAIN]
        J[:, :, _DRIFT] = postures.course[:, None, None] * np.eye(6)
        by_entry = np.eye(6)[None, :, :, None] * (model.spread * wrench[:, None, :])[:, :, None, :]
        J[:, :, _MATRIX] = by_entry.reshape(n, 6, 36)
    J[:, :3, 4:7] = J[:, 3:, 10:13] = np.eye(3)
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
    """Members of `TOOL_UNKNOWNS` that the postures do not determine; they keep their initial
    values."""
    count: int
    """Postures."""
    force_scatter: float
    """Standard deviation of what is left of a force component, in N; NaN: nothing is left over."""
    moment_scatter: float
    """The same of the moment, in N·m."""
    model: ToolModel = field(default_factory=ToolModel)
    """Free unknowns."""
    drift: FloatArray = field(default_factory=lambda: np.zeros(6))
    """Change of the biases from the first posture to the last, shape (6,), in N and N·m."""
    matrix: FloatArray = field(default_factory=lambda: np.eye(6))
    """``1 + X``: what the sensor reads of a wrench, shape (6, 6)."""
    matrix_determined: FloatArray = field(default_factory=lambda: np.zeros((6, 6)))
    """Share of the prior's variance of each entry that the postures took away, 0 to 1."""
    matrix_rank: int = 0
    """Directions of the 36 entries of which the postures halve the prior's deviation."""

    @property
    def rotation_known(self) -> bool:
        """Whether the rotation was taken as it is."""
        return not self.model.rotation


def fit_tool(
    postures: StaticPostures, R_nominal: FloatArray | None = None, model: ToolModel | None = None
) -> ToolFit:
    """Return tool and sensor from static postures.

    Parameters
    ----------
    postures : StaticPostures
        At least three.
    R_nominal : ndarray, shape (3, 3), optional
        Rotation of the sensor in the flange as it was mounted; the identity by default. What the
        postures do not determine stays there.
    model : ToolModel, optional
        What is free; by default mass, centre of mass and biases.
    """
    nominal = np.eye(3) if R_nominal is None else R_nominal
    model = model or ToolModel()
    R = _rotation_between(postures, nominal) if model.rotation else nominal
    size = np.array([np.abs(part).max() for part in (postures.force, postures.moment)])
    least = _ROUNDING * np.where(size > 0.0, size, 1.0)
    # First without the matrix: the weight of the prior depends on the scatter, which is not known
    # yet.
    start = ToolModel(model.rotation, model.drift) if model.has_matrix else model
    found = _WeighedFit(postures, start, np.zeros(_ALL), R, np.ones(2))
    # Each stage twice: the second fit has the weights that the scatter of the first gives.
    for stage in (start, start, model, model):
        found = replace(found, model=stage).descended()
        scatter = found.scatter()
        if np.all(np.isfinite(scatter)):
            found = replace(found, weights=1.0 / np.maximum(scatter, least))
    return found.result(scatter)


def tool_residual(postures: StaticPostures, fit: ToolFit) -> tuple[FloatArray, FloatArray]:
    """Return the rest of forces and moments after a fit, shapes (posture, 3)."""
    weight = fit.mass * (postures.gravity_flange @ fit.R_flange_sensor)
    wrench = np.hstack([weight, np.cross(fit.centre, weight)]) @ fit.matrix.T
    wrench += postures.course[:, None] * fit.drift
    return (
        postures.force - wrench[:, :3] - fit.force_bias,
        postures.moment - wrench[:, 3:] - fit.moment_bias,
    )


def rotation_off(R_nominal: FloatArray, R: FloatArray) -> FloatArray:
    """Return the rotation vector from a nominal rotation to another, sensor axes, in rad."""
    return np.asarray(Rotation.from_matrix(R_nominal.T @ R).as_rotvec())


def _rotation_between(postures: StaticPostures, nominal: FloatArray) -> FloatArray:
    """Return the rotation that best turns gravity into forces, the nominal one where open."""
    u = postures.gravity_flange - postures.gravity_flange.mean(axis=0)
    F = postures.force - postures.force.mean(axis=0)
    s = np.linalg.svd(u.T @ F, compute_uv=False)
    if not s[1] > _LOADING * max(s[0], np.finfo(float).tiny):
        return nominal
    return nearest_rotation(u.T @ F)


@dataclass(frozen=True, eq=False)
class _WeighedFit:
    """Values of a model of the tool, and the weights of force and moment components."""

    postures: StaticPostures
    model: ToolModel
    values: FloatArray
    """As in `tool_wrenches`; the rotation is 0, about ``R``."""
    R: FloatArray
    weights: FloatArray
    """Weights of a force and of a moment component, shape (2,)."""

    def left(self) -> FloatArray:
        """Return the rest of forces and moments, shape (posture, 6)."""
        measured = np.hstack([self.postures.force, self.postures.moment])
        return measured - tool_wrenches(self.postures, self.values, self.R, self.model)

    def descended(self) -> "_WeighedFit":
        """Return the least squares."""
        fit, free = self, self.model.free
        for _ in range(_STEPS):
            left = fit.left() * np.repeat(fit.weights, 3)
            rows = np.concatenate([left.ravel(), -fit.values[_MATRIX][free[_MATRIX]]])
            u, s, vt, scale, kept = fit.decomposed
            step = np.zeros(_ALL)
            step[free] = (vt[kept].T @ ((u[:, kept].T @ rows) / s[kept])) / scale
            values = fit.values + step
            # The step in rotation goes into R, about which the next linearisation is made: rotation
            # vectors do not add.
            values[_ROTATION] = 0.0
            turn = Rotation.from_rotvec(step[_ROTATION]).as_matrix()
            fit = replace(fit, values=values, R=fit.R @ turn)
            if np.abs(step).max() <= _DONE * max(1.0, float(np.abs(values).max())):
                break
        return fit

    @cached_property
    def decomposed(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, BoolArray]:
        """Return the singular value decomposition ``u s vt`` of the weighed derivatives.

        Rows of the prior follow those of the postures. Columns of the free unknowns are divided by
        their ``scale`` first; the last array marks the determined directions.
        """
        free = self.model.free
        J = tool_derivatives(self.postures, self.values, self.R, self.model)
        J *= np.repeat(self.weights, 3)[:, None]
        prior = np.eye(_ALL)[_MATRIX][free[_MATRIX]]
        J = np.vstack([J.reshape(-1, _ALL), prior])[:, free]
        scale = np.linalg.norm(J, axis=0)
        # A column of rounding errors is not magnified to the size of the others.
        scale[scale <= _DEPENDENT * scale.max()] = scale.max()
        u, s, vt = np.linalg.svd(J / scale, full_matrices=False)
        return u, s, vt, scale, s > _DEPENDENT * s[0]

    def scatter(self) -> FloatArray:
        """Return the standard deviations of what is left of force and moment components."""
        squares = (self.left().reshape(-1, 2, 3) ** 2).sum(axis=(0, 2))
        over = self.left_over()
        # Half a degree of freedom is rounding of the leverages; with none left the scatter is
        # unknown.
        return np.where(over > 0.5, np.sqrt(squares / np.maximum(over, 0.5)), np.nan)

    def left_over(self) -> FloatArray:
        """Return the residual degrees of freedom of force and moment, by their leverage."""
        u, _, _, _, kept = self.decomposed
        rows = 6 * len(self.postures)
        taken = (u[:rows, kept] ** 2).sum(axis=1).reshape(-1, 2, 3).sum(axis=(0, 2))
        over: FloatArray = 0.5 * rows - taken
        return over

    def result(self, scatter: FloatArray) -> ToolFit:
        """Return tool and sensor with their intervals."""
        postures, model, values, free = self.postures, self.model, self.values, self.model.free
        _, s, vt, scale, kept = self.decomposed
        mass = float(values[0])
        centre = values[7:10] / (mass if abs(mass) > 0.0 else np.inf)
        # Rows: how each unknown moves with the independent directions, each by its deviation.
        moves = np.zeros((_ALL, int(kept.sum())))
        moves[free] = (vt[kept] / s[kept, None]).T / scale[:, None]
        moves[7:10] = (moves[7:10] - centre[:, None] * moves[0]) / max(abs(mass), _NO_MASS)
        sigma = np.linalg.norm(moves, axis=1)
        # Columns that are weighed have scatter 1; those that are not have what is left of them.
        unit = 1.0 if np.all(scatter > 0.0) else float(np.nan_to_num(scatter).max())
        degrees = float(self.left_over().sum())
        half = stdtrit(max(degrees, 1.0), 0.5 + _LEVEL / 2) * sigma[:_PLAIN] * unit
        loose = np.zeros(_ALL, dtype=bool)
        loose[free] = np.linalg.norm(vt[~kept], axis=0) > _LOADING
        loose = loose[:_PLAIN]
        if degrees < 0.5:
            half[:] = np.nan
        loose |= ~(half <= _widest(mass, postures))
        half[loose] = np.nan
        # In deviations of the prior the entries' covariance is the identity before any posture.
        entries = moves[_MATRIX] @ moves[_MATRIX].T if model.has_matrix else np.eye(36)
        return ToolFit(
            mass=mass,
            centre=centre,
            force_bias=values[4:7],
            moment_bias=values[10:13],
            R_flange_sensor=self.R,
            half_width=dict(zip(TOOL_UNKNOWNS, half.tolist(), strict=True)),
            undetermined=tuple(
                name for name, open_ in zip(TOOL_UNKNOWNS, loose, strict=True) if open_
            ),
            count=len(postures),
            force_scatter=float(scatter[0]),
            moment_scatter=float(scatter[1]),
            model=model,
            drift=values[_DRIFT],
            matrix=np.eye(6) + values[_MATRIX].reshape(6, 6) * model.spread,
            matrix_determined=np.clip(1.0 - np.diag(entries), 0.0, 1.0).reshape(6, 6),
            matrix_rank=int((np.linalg.eigvalsh(entries) < 0.25).sum()),
        )


def _widest(mass: float, postures: StaticPostures) -> FloatArray:
    """Return the half widths beyond which an unknown counts as not determined."""
    weight = abs(mass) * float(np.linalg.norm(postures.gravity))
    widest = [_WIDE_ROTATION, _WIDE_BIAS * weight, _WIDE_CENTRE, _WIDE_BIAS * weight * 0.1]
    return np.array([_WIDE_MASS * abs(mass), *np.repeat(widest, 3)])
