"""What a person should look at before a tool is believed: no mistake that is certain."""

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.conditioning.postures import StaticPostures
from elastocal.compensation.conditioning.tool_fit import ToolFit, tool_residual

_TURNED = np.radians(15.0)
"""Least spread of the postures that tells a weight, in rad."""
_LEAST_LEVER, _LEVER_RATIO = 0.02, 5.0
"""Distance of a centre of mass from its sensor in m, and how far it may be from the stated one."""
_MUCH_LEFT, _LEAST_LEFT = 0.05, 3.0
"""What may be left of a force component, or drift, over the weight, and in N."""
_LEAST_MASS, _MOST_MASS = 0.6, 1.15
"""Part of the stated mass that a sensor may feel: its own lower half is none of it."""
_FORCE_UNITS = {"kgf": 9.80665, "lbf": 4.4482216, "kN": 1e3, "N, not kgf": 1 / 9.80665}
"""Forces that are taken for newtons, with their size in N."""
_NEAR = 0.1
"""How near a ratio of masses must be to that of two units."""


def tool_doubts(
    postures: StaticPostures,
    fit: ToolFit,
    known_mass: float | None = None,
    known_centre: FloatArray | None = None,
) -> tuple[str, ...]:
    """Return what a person should look at before a tool is believed.

    Parameters
    ----------
    postures : StaticPostures
        That it was fitted to.
    fit : ToolFit
        Of these.
    known_mass : float, optional
        Mass of the tool by another source, in kg.
    known_centre : ndarray, shape (3,), optional
        Its centre of mass in the sensor's frame, in m.
    """
    found = []
    weight = abs(fit.mass) * float(np.linalg.norm(postures.gravity))
    left = float(np.sqrt(np.mean(np.square(tool_residual(postures, fit)[0]))))
    if postures.spread < _TURNED:
        found.append(
            f"gravity turns by {np.degrees(postures.spread):.2g} deg in the sensor over all"
            " postures, too little to tell a weight: turn the tool about two axes"
        )
    if left > max(_MUCH_LEFT * weight, _LEAST_LEFT):
        found.append(
            f"{left:.3g} N are left of a force component beside a tool of {weight:.3g} N: was it"
            " touched in some postures, does a cable pull?"
        )
    drift = float(np.linalg.norm(fit.drift[:3]))
    if drift > _MUCH_LEFT * weight:
        found.append(
            f"the bias drifts by {drift:.3g} N from the first posture to the last, the tool weighs"
            f" {weight:.3g} N: let the sensor warm up, or tare it at each pose"
        )
    if known_mass is not None and "mass" not in fit.undetermined:
        found.extend(other_mass(fit.mass, known_mass))
    if known_centre is not None:
        found.extend(other_centre(fit, known_centre))
    return tuple(found)


def other_mass(found: float, known: float) -> tuple[str, ...]:
    """Return the sentence about a mass that is not the known one; none where both agree.

    The tool of a cell file is everything behind the flange, of which a sensor carries its part.

    Parameters
    ----------
    found : float
        By the weight that a sensor feels, in kg.
    known : float
        By the scales or the drawing, in kg; 0: not known.
    """
    if not known > 0.0 or _LEAST_MASS * known <= found <= _MOST_MASS * known:
        return ()
    unit = next(
        (name for name, ratio in _FORCE_UNITS.items() if abs(found / known * ratio - 1.0) < _NEAR),
        "",
    )
    why = f"are the forces in {unit}?" if unit else "are the forces in another unit or gain?"
    return (
        f"the sensor feels a tool of {found:.3g} kg, which weighs {known:.3g} kg as stated: {why}",
    )


def other_centre(fit: ToolFit, known: FloatArray) -> tuple[str, ...]:
    """Return the sentence about a centre of mass at another distance than the known one.

    Parameters
    ----------
    fit : ToolFit
        Of static postures.
    known : ndarray, shape (3,)
        By the drawing, in the sensor's frame, in m.
    """
    found, stated = (float(np.linalg.norm(each)) for each in (fit.centre, known))
    if any(name.startswith("centre") for name in fit.undetermined) or not stated > _LEAST_LEVER:
        return ()
    if stated / _LEVER_RATIO < found < stated * _LEVER_RATIO:
        return ()
    return (
        f"the moments put the tool's centre of mass {1e3 * found:.3g} mm from the sensor, which is"
        f" {1e3 * stated:.3g} mm as stated: are they in another unit?",
    )
