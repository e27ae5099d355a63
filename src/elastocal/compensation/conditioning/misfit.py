"""Postures that no tool explains: a spoilt one, a rotation that is not as mounted, a wrong unit."""

from collections.abc import Iterable

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.conditioning.postures import LEAST, StaticPostures
from elastocal.compensation.conditioning.tool_fit import ToolFit, fit_tool, residual
from elastocal.errors import CompensationError

HEAVIEST = 5000.0
"""In kg; robots carry up to 2300 kg."""
_POOR = 0.1
"""Part of what turns with the posture that may be left: noise, cross-talk leave a few percent."""
_NOISE = np.array([5.0, 0.5])
"""In N and N·m: what a noisy sensor leaves of a light tool, and what deflects no arm."""
_BETTER = 0.2
"""Share of what is left, from which on another reading is believed."""
_TURNED = np.radians(15.0)
"""Least spread of the postures for a verdict, in rad."""
_TRIED = 10
"""Postures that are left out in turn, those with most left first."""


def refuse_misfit(postures: StaticPostures, fit: ToolFit, R_nominal: FloatArray | None) -> None:
    """Refuse postures that do not fit one tool, saying why where that can be found.

    Parameters
    ----------
    postures : StaticPostures
        As stated.
    fit : ToolFit
        Of these.
    R_nominal : ndarray, shape (3, 3), optional
        Rotation of the sensor in the flange as it was mounted.

    Raises
    ------
    CompensationError
        Naming the posture, the angle or the unit.
    """
    if fit.mass > HEAVIEST:
        raise CompensationError(
            f"mass comes out as {fit.mass:.4g} kg, more than a robot carries ({HEAVIEST:g} kg):"
            " forces in another unit than stated"
        )
    left, turning = _left(postures, fit), _turning(postures)
    if not np.any(left > _allowed(postures)):
        return
    _refuse_one_posture(postures, fit, R_nominal, left)
    if fit.rotation_known:
        _refuse_rotation(postures, fit, left)
    # Without weight, or turned too little, noise is all that changes: undetermined, no misfit.
    weight = abs(fit.mass) * float(np.linalg.norm(postures.gravity))
    if postures.spread > _TURNED and weight > left[0]:
        which = int(np.argmax(left / _allowed(postures)))
        unit = ("N", "N*m")[which]
        raise CompensationError(
            f"the postures do not fit one tool: {left[which]:.3g} {unit} are left of a component of"
            f" the {('force', 'moment')[which]}, of {turning[which]:.3g} {unit} that change with"
            " the posture: was the robot at rest, the tool free, the cables slack?"
        )


def _refuse_one_posture(
    postures: StaticPostures, fit: ToolFit, R_nominal: FloatArray | None, left: FloatArray
) -> None:
    if len(postures) <= LEAST + 1:
        return
    for row in _suspects(postures, fit):
        others = postures.without(row)
        refit = fit_tool(others, R_nominal, fit.rotation_known)
        without = _left(others, refit)
        worst = int(np.argmax(left / np.maximum(without, np.finfo(float).tiny)))
        if np.all(without <= _allowed(others)) and without[worst] < _BETTER * left[worst]:
            unit = ("N", "N*m")[worst]
            raise CompensationError(
                f"posture {row + 1} does not fit the others: {left[worst]:.3g} {unit} are left of a"
                f" component, without it {without[worst]:.3g} {unit}: measure it again or leave it"
                " out"
            )


def _suspects(postures: StaticPostures, fit: ToolFit) -> Iterable[int]:
    force, moment = (
        np.linalg.norm(part, axis=1) / max(float(np.abs(part).max()), np.finfo(float).tiny)
        for part in residual(postures, fit)
    )
    worst: list[int] = np.argsort(-np.maximum(force, moment), kind="stable").tolist()
    return worst[:_TRIED]


def _refuse_rotation(postures: StaticPostures, fit: ToolFit, left: FloatArray) -> None:
    free = fit_tool(postures, fit.R_flange_sensor)
    found = _left(postures, free)
    if np.any(found < _BETTER * left):
        cosine = 0.5 * (np.trace(fit.R_flange_sensor.T @ free.R_flange_sensor) - 1.0)
        angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
        raise CompensationError(
            f"the sensor is not turned as --sensor says: with {left[0]:.3g} N left of a force"
            f" component, {found[0]:.3g} N if it sits {angle:.1f} deg from there; leave out"
            " --keep-rotation"
        )


def _left(postures: StaticPostures, fit: ToolFit) -> FloatArray:
    """Return what is left of a component of force and moment, root mean square."""
    return np.array([_rms(part) for part in residual(postures, fit)])


def _allowed(postures: StaticPostures) -> FloatArray:
    allowed: FloatArray = np.maximum(_POOR * _turning(postures), _NOISE)
    return allowed


def _turning(postures: StaticPostures) -> FloatArray:
    """Return what changes with the posture of a component of force and moment."""
    return np.array([_rms(part - part.mean(axis=0)) for part in (postures.force, postures.moment)])


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
