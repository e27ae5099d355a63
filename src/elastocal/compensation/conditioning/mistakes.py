"""Mistakes in static postures: frames, signs and units read otherwise, and what fits no tool.

The same idea as the verdict on a dataset's conventions: a reading that explains the data far
better than what the file says is what was measured. What no reading explains is refused, too: a
spoilt posture, a rotation that is not as mounted, a wrong unit.
"""

from collections.abc import Iterable, Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.compensation.conditioning._undone import (
    SENSOR_TURNED as SENSOR_TURNED,
    force_mistake,
    moment_mistake,
)
from elastocal.compensation.conditioning.postures import LEAST_POSTURES, StaticPostures
from elastocal.compensation.conditioning.tool_choice import affine_scatter
from elastocal.compensation.conditioning.tool_fit import (
    ToolFit,
    ToolModel,
    fit_tool,
    tool_residual,
)
from elastocal.errors import CompensationError
from elastocal.parallel import one_blas_thread

_HEAVIEST = 5000.0
"""In kg; robots carry up to 2300 kg."""
_FREE = ToolModel(rotation=True)
_ORDERS = (("x y z w", "w x y z", [1, 2, 3, 0]), ("w x y z", "x y z w", [3, 0, 1, 2]))
"""Orders of a quaternion: as the columns are named, as the numbers are, where these then stand."""
_UNITS = ("N", "N*m")
_POOR = 0.1
"""Part of what turns with the posture that may be left: noise, cross-talk leave a few percent."""
_NOISE = np.array([5.0, 0.5])
"""In N and N·m: noise of a sensor where too few postures tell it."""
_ABOVE_NOISE = 3.0
"""What is left, in what the best affine law of gravity leaves, that is more than noise."""
_MUCH_BETTER = 0.2
"""Share of what is left, from which on another reading is believed."""
_TRIED = 10
"""Postures that are left out in turn, those with most left first."""
_BETTER = 0.5
"""Residual of another reading, as a share of the stated one's, from which on it is believed."""
_NOTICEABLE = 1e-3
"""Residual, as a share of the readings' size, below which the stated reading is right."""
_LIGHT = 0.1
"""Weight, as a share of what is constant, below which a sensor seems to feel no weight turn."""
_TURNED = np.radians(15.0)
"""Least spread of the postures for a verdict, in rad."""
_FARTHEST = 3.0
"""Largest distance of a centre of mass from its sensor that is believed, in m."""
_CLEAR = 10.0
"""Change of the moment, as a multiple of its scatter, from which on that is believed."""
_CLOSE = 0.3
"""Largest distance of the centre of mass from where another point puts it, as a share."""


@one_blas_thread()
def refuse_mistakes(
    postures: StaticPostures,
    fit: ToolFit,
    R_nominal: FloatArray | None = None,
    expected_centre: FloatArray | None = None,
    points: Mapping[str, FloatArray] | None = None,
) -> None:
    """Refuse postures that are explained by another reading of their numbers.

    Parameters
    ----------
    postures : StaticPostures
        As stated.
    fit : ToolFit
        Of these.
    R_nominal : ndarray, shape (3, 3), optional
        Rotation of the sensor in the flange as it was mounted.
    expected_centre : ndarray, shape (3,), optional
        Where the tool's centre of mass should be, in the sensor's frame, in m; without it
        nothing tells about which point the moments are.
    points : mapping of str to ndarray, optional
        Points that moments may be about, in the sensor's frame, in m.

    Raises
    ------
    CompensationError
        Naming the mistake.
    """
    if fit.rotation_known:
        refuse_other_readings(postures, fit.R_flange_sensor, fit.model.lever)
    # Judged with the rotation free: a sensor that sits elsewhere is another mistake.
    free = fit if fit.model.rotation else fit_tool(postures, R_nominal, _FREE)
    _refuse_other_order(postures, free, R_nominal)
    _refuse_base(postures, free)
    _refuse_other_forces(postures, fit, free, R_nominal)
    _refuse_other_moments(postures, free)
    _refuse_far_centre(postures, fit)
    _refuse_misfit(postures, fit, R_nominal)
    if expected_centre is not None:
        _refuse_other_point(fit, expected_centre, points or {})


def refuse_other_readings(
    postures: StaticPostures, R_flange_sensor: FloatArray, lever: float
) -> None:
    """Refuse postures that one tool explains once a mistake is undone, the sensor as mounted.

    Parameters
    ----------
    postures : StaticPostures
        As stated.
    R_flange_sensor : ndarray, shape (3, 3)
        As mounted.
    lever : float
        The sensor's moment range over its force range, in m.

    Raises
    ------
    CompensationError
        Naming the mistake.
    """
    for mistake in (force_mistake, moment_mistake):
        found = mistake(postures, R_flange_sensor, lever)
        if found is not None:
            raise CompensationError(found)


def _refuse_misfit(postures: StaticPostures, fit: ToolFit, R_nominal: FloatArray | None) -> None:
    """Refuse postures that do not fit one tool, saying why where that can be found."""
    if fit.mass > _HEAVIEST:
        raise CompensationError(
            f"mass comes out as {fit.mass:.4g} kg, more than a robot carries ({_HEAVIEST:g} kg):"
            " forces in another unit than stated"
        )
    left, turning = _left(postures, fit), _turning(postures)
    if not np.any(left > _allowed(postures)):
        return
    _refuse_one_posture(postures, fit, R_nominal, left)
    # Without weight, or turned too little, noise is all that changes: undetermined, no misfit.
    if postures.spread > _TURNED and _weight(postures, fit) > left[0]:
        which = int(np.argmax(left / _allowed(postures)))
        unit = _UNITS[which]
        raise CompensationError(
            f"the postures do not fit one tool: {left[which]:.3g} {unit} are left of a component of"
            f" the {('force', 'moment')[which]}, of {turning[which]:.3g} {unit} that change with"
            " the posture: was the robot at rest, the tool free, the cables slack?"
        )


def _refuse_one_posture(
    postures: StaticPostures, fit: ToolFit, R_nominal: FloatArray | None, left: FloatArray
) -> None:
    if len(postures) <= LEAST_POSTURES + 1:
        return
    for row in _suspects(postures, fit):
        others = postures.chosen(np.arange(len(postures)) != row)
        refit = fit_tool(others, R_nominal, fit.model)
        without = _left(others, refit)
        worst = int(np.argmax(left / np.maximum(without, np.finfo(float).tiny)))
        if np.all(without <= _allowed(others)) and without[worst] < _MUCH_BETTER * left[worst]:
            unit = _UNITS[worst]
            raise CompensationError(
                f"posture {row + 1} does not fit the others: {left[worst]:.3g} {unit} are left of a"
                f" component, without it {without[worst]:.3g} {unit}: measure it again or leave it"
                " out"
            )


def _suspects(postures: StaticPostures, fit: ToolFit) -> Iterable[int]:
    force, moment = (
        np.linalg.norm(part, axis=1) / max(float(np.abs(part).max()), np.finfo(float).tiny)
        for part in tool_residual(postures, fit)
    )
    worst: list[int] = np.argsort(-np.maximum(force, moment), kind="stable").tolist()
    return worst[:_TRIED]


def _left(postures: StaticPostures, fit: ToolFit) -> FloatArray:
    """Return what is left of a component of force and moment, root mean square."""
    return np.array([_rms(part) for part in tool_residual(postures, fit)])


def _allowed(postures: StaticPostures) -> FloatArray:
    scatter = affine_scatter(postures)
    noise = _NOISE if scatter is None else _ABOVE_NOISE * scatter
    allowed: FloatArray = np.maximum(_POOR * _turning(postures), noise)
    return allowed


def _turning(postures: StaticPostures) -> FloatArray:
    """Return what changes with the posture of a component of force and moment."""
    return np.array([_rms(part - part.mean(axis=0)) for part in (postures.force, postures.moment)])


def _refuse_other_order(
    postures: StaticPostures, free: ToolFit, R_nominal: FloatArray | None
) -> None:
    """Refuse quaternions whose numbers stand in the other order of the two in use."""
    if not postures.quaternions:
        return
    stated = _rms(tool_residual(postures, free)[0])
    if not stated > _NOTICEABLE * _rms(postures.force):
        return
    quaternions = Rotation.from_matrix(postures.R_base_flange).as_quat()
    for named, actual, places in _ORDERS:
        R = Rotation.from_quat(quaternions[:, places]).as_matrix()
        other = postures.read_as(R_base_flange=R)
        left = _rms(tool_residual(other, fit_tool(other, R_nominal, _FREE))[0])
        if left < _MUCH_BETTER * stated:
            raise CompensationError(
                f"the quaternions' numbers stand in the order {actual}, their columns are named"
                f" {named}: read so, {left:.3g} N are left of a force component instead of"
                f" {stated:.3g} N; rename the columns"
            )


def _refuse_base(postures: StaticPostures, fit: ToolFit) -> None:
    """Refuse wrenches in base: the weight does not turn with the sensor, it looks like a bias."""
    g = postures.gravity
    R = postures.R_base_flange
    # F = mass g + R b in base, if b is the bias in the flange's axes.
    A = np.dstack([np.broadcast_to(g[:, None], (len(R), 3, 1)), R]).reshape(-1, 4)
    solution, *_ = np.linalg.lstsq(A, postures.force.ravel(), rcond=None)
    left = _rms(postures.force.ravel() - A @ solution)
    stated = _rms(tool_residual(postures, fit)[0])
    constant = float(np.linalg.norm(fit.force_bias))
    upright = float(fit.force_bias @ g) > 0.9 * constant * float(np.linalg.norm(g))
    seems_constant = (
        _weight(postures, fit) < _LIGHT * constant and upright and postures.spread > _TURNED
    )
    noticeable = stated > _NOTICEABLE * _rms(postures.force)
    if solution[0] > 0.0 and (seems_constant or (noticeable and left < _BETTER * stated)):
        raise CompensationError(
            "wrenches seem to be in base already: the weight does not turn with the sensor"
            f" ({solution[0]:.3g} kg along gravity in all {len(postures)} postures); give the raw"
            " ones, in the sensor's frame"
        )


def _refuse_other_forces(
    postures: StaticPostures, fit: ToolFit, free: ToolFit, R_nominal: FloatArray | None
) -> None:
    stated = _rms(tool_residual(postures, free)[0])
    others = {
        "the sign of the wrenches is turned, or one of the sensor's axes (a left-handed frame),"
        " or gravity": (postures.read_as(-postures.force, -postures.moment)),
        "the orientations are those of the base in the flange: invert them": (
            postures.read_as(R_base_flange=np.swapaxes(postures.R_base_flange, 1, 2))
        ),
    }
    fits = {mistake: fit_tool(other, R_nominal, _FREE) for mistake, other in others.items()}
    left = {mistake: _rms(tool_residual(others[mistake], fits[mistake])[0]) for mistake in others}
    best = min(left, key=left.__getitem__)
    if stated > _NOTICEABLE * _rms(postures.force) and left[best] < _BETTER * stated:
        raise CompensationError(
            f"{best}: read so, {left[best]:.3g} N are left of a force component instead of"
            f" {stated:.3g} N"
        )
    turned = next(iter(others))
    as_mounted = np.eye(3) if R_nominal is None else R_nominal
    # With gravity turning in one plane both signs fit; where the sensor sits tells them apart.
    fits_both = left[turned] <= 1.5 * stated + _NOTICEABLE * _rms(postures.force)
    weighs = _weight(postures, fit) > _NOTICEABLE * _rms(postures.force)
    if (fit.mass < 0.0 and weighs and "mass" not in fit.undetermined) or (
        fits_both
        and _angle(free.R_flange_sensor, as_mounted) > 0.5 * np.pi
        and _angle(fits[turned].R_flange_sensor, as_mounted) < 0.25 * np.pi
    ):
        raise CompensationError(
            f"{turned}: the mass comes out as {fit.mass:.3g} kg and the sensor"
            f" {np.degrees(_angle(free.R_flange_sensor, as_mounted)):.0f} deg from where it sits"
        )


def _refuse_other_moments(postures: StaticPostures, fit: ToolFit) -> None:
    stated = _rms(tool_residual(postures, fit)[1])
    if not stated > 10.0 * _NOTICEABLE * max(_rms(postures.moment), 1e-9):
        return
    R = postures.R_base_flange @ fit.R_flange_sensor
    other = postures.read_as(moment=np.einsum("nji,nj->ni", R, postures.moment))
    left = _rms(tool_residual(other, fit_tool(other, fit.R_flange_sensor))[1])
    if left < _BETTER * stated:
        raise CompensationError(
            f"moments seem to be in base while the forces are not: read so, {left:.3g} N*m are left"
            f" of a component instead of {stated:.3g} N*m"
        )


def _refuse_far_centre(postures: StaticPostures, fit: ToolFit) -> None:
    """Refuse a centre of mass far away, where a moment in N·mm that is called N·m puts it."""
    distance = float(np.linalg.norm(fit.centre))
    seen = _turning(postures)[1] > _CLEAR * fit.moment_scatter and "mass" not in fit.undetermined
    if seen and distance > _FARTHEST:
        raise CompensationError(
            f"centre of mass comes out {distance:.3g} m from the sensor: forces or moments in"
            " another unit than stated, or moments about a point far away"
        )


def _refuse_other_point(
    fit: ToolFit, expected: FloatArray, points: Mapping[str, FloatArray]
) -> None:
    if any(name.startswith("centre") for name in fit.undetermined):
        return
    off, lever = (float(np.linalg.norm(v)) for v in (fit.centre - expected, expected))
    if off > lever > 0.0 and float(np.linalg.norm(fit.centre + expected)) < _CLOSE * lever:
        raise CompensationError(
            "the sign of the moments is turned: the centre of mass comes out opposite to where it"
            f" should be, {1e3 * lever:.0f} mm from the sensor's origin"
        )
    for name, point in points.items():
        arm = float(np.linalg.norm(point))
        # About a point p the weight's lever is c - p.
        if off > (1.0 - _CLOSE) * arm > 0.0 and (
            float(np.linalg.norm(fit.centre - (expected - point))) < _CLOSE * arm
        ):
            raise CompensationError(
                f"moments seem to be about the {name}, not the sensor's origin: the centre of mass"
                f" comes out {1e3 * off:.0f} mm from where it should be, which is that lever"
            )


def _weight(postures: StaticPostures, fit: ToolFit) -> float:
    return abs(fit.mass) * float(np.linalg.norm(postures.gravity))


def _angle(a: FloatArray, b: FloatArray) -> float:
    return float(np.arccos(np.clip(0.5 * (np.trace(a.T @ b) - 1.0), -1.0, 1.0)))


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
