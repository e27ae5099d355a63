"""Frame mistakes in static postures: found by reading the numbers otherwise, and named.

The same idea as the verdict on a dataset's conventions: a reading that explains the data far
better than what the file says is what was measured.
"""

from collections.abc import Mapping

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.conditioning.misfit import refuse_misfit
from elastocal.compensation.conditioning.postures import StaticPostures
from elastocal.compensation.conditioning.tool_fit import ToolFit, fit_tool, residual
from elastocal.errors import CompensationError

_BETTER = 0.5
"""Residual of another reading, as a share of the stated one's, from which on it is believed."""
_NOTICEABLE = 1e-3
"""Residual, as a share of the readings' size, below which the stated reading is right."""
_LIGHT = 0.1
"""Weight, as a share of what is constant, below which a sensor seems to feel no weight turn."""
_TURNED = np.radians(15.0)
"""Least spread of the postures for that verdict, in rad."""
_FARTHEST = 3.0
"""Largest distance of a centre of mass from its sensor that is believed, in m."""
_CLEAR = 10.0
"""How many times its scatter the moment must change for that."""
_CLOSE = 0.3
"""How near the centre of mass must come to where another point would put it, as a share."""


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
    _refuse_base(postures, fit)
    _refuse_other_forces(postures, fit, R_nominal)
    _refuse_other_moments(postures, fit)
    _refuse_far_centre(postures, fit)
    refuse_misfit(postures, fit, R_nominal)
    if expected_centre is not None:
        _refuse_other_point(fit, expected_centre, points or {})


def _refuse_base(postures: StaticPostures, fit: ToolFit) -> None:
    """In base, the weight does not turn with the sensor: it looks like a bias."""
    g = postures.gravity
    R = postures.R_base_flange
    # F = mass g + R b in base, if b is the bias in the flange's axes.
    A = np.concatenate([np.broadcast_to(g[None, :, None], (len(R), 3, 1)), R], axis=2)
    A = A.reshape(-1, 4)
    solution, *_ = np.linalg.lstsq(A, postures.force.ravel(), rcond=None)
    left = _rms(postures.force.ravel() - A @ solution)
    stated = _rms(residual(postures, fit)[0])
    weight = abs(fit.mass) * float(np.linalg.norm(g))
    constant = float(np.linalg.norm(fit.force_bias))
    upright = float(fit.force_bias @ g) > 0.9 * constant * float(np.linalg.norm(g))
    seems_constant = weight < _LIGHT * constant and upright and postures.spread > _TURNED
    noticeable = stated > _NOTICEABLE * _rms(postures.force)
    if solution[0] > 0.0 and (seems_constant or (noticeable and left < _BETTER * stated)):
        raise CompensationError(
            "wrenches seem to be in base already: the weight does not turn with the sensor"
            f" ({solution[0]:.3g} kg along gravity in all {len(postures)} postures); give the raw"
            " ones, in the sensor's frame"
        )


def _refuse_other_forces(
    postures: StaticPostures, fit: ToolFit, R_nominal: FloatArray | None
) -> None:
    stated = _rms(residual(postures, fit)[0])
    others = {
        "the sign of the wrenches is turned, or one of the sensor's axes (a left-handed frame)": (
            postures.read_as(-postures.force, -postures.moment)
        ),
        "the orientations are those of the base in the flange: invert them": (
            postures.read_as(R_base_flange=np.swapaxes(postures.R_base_flange, 1, 2))
        ),
    }
    fits = {mistake: fit_tool(other, R_nominal) for mistake, other in others.items()}
    left = {mistake: _rms(residual(others[mistake], fits[mistake])[0]) for mistake in others}
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
    weight = abs(fit.mass) * float(np.linalg.norm(postures.gravity))
    weighs = weight > _NOTICEABLE * _rms(postures.force)
    if (fit.mass < 0.0 and weighs and "mass" not in fit.undetermined) or (
        fits_both
        and _angle(fit.R_flange_sensor, as_mounted) > 0.5 * np.pi
        and _angle(fits[turned].R_flange_sensor, as_mounted) < 0.25 * np.pi
    ):
        raise CompensationError(
            f"{turned}: the mass comes out as {fit.mass:.3g} kg and the sensor"
            f" {np.degrees(_angle(fit.R_flange_sensor, as_mounted)):.0f} deg from where it sits"
        )


def _refuse_other_moments(postures: StaticPostures, fit: ToolFit) -> None:
    stated = _rms(residual(postures, fit)[1])
    if not stated > 10.0 * _NOTICEABLE * max(_rms(postures.moment), 1e-9):
        return
    R = postures.R_base_flange @ fit.R_flange_sensor
    other = postures.read_as(moment=np.einsum("nji,nj->ni", R, postures.moment))
    left = _rms(residual(other, fit_tool(other, fit.R_flange_sensor, rotation_known=True))[1])
    if left < _BETTER * stated:
        raise CompensationError(
            f"moments seem to be in base while the forces are not: read so, {left:.3g} N*m are left"
            f" of a component instead of {stated:.3g} N*m"
        )


def _refuse_far_centre(postures: StaticPostures, fit: ToolFit) -> None:
    """Refuse a centre of mass far away, where a moment in N·mm that is called N·m puts it."""
    distance = float(np.linalg.norm(fit.centre))
    turning = _rms(postures.moment - postures.moment.mean(axis=0))
    seen = turning > _CLEAR * fit.moment_scatter and "mass" not in fit.undetermined
    if seen and distance > _FARTHEST:
        raise CompensationError(
            f"centre of mass comes out {distance:.3g} m from the sensor: moments in another unit"
            " than stated, or about a point far away"
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


def _angle(a: FloatArray, b: FloatArray) -> float:
    return float(np.arccos(np.clip(0.5 * (np.trace(a.T @ b) - 1.0), -1.0, 1.0)))


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
