"""Every search for mistakes in readings, the surest first, and what follows from what is found."""

from collections.abc import Sequence

from numpy.typing import ArrayLike

from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.errors import ConventionError
from elastocal.findings import Finding, Grade, Kind, as_number
from elastocal.identification.conventions import POOR_FIT, check_conventions, check_joints
from elastocal.identification.mistakes.plausibility import (
    COUNTS,
    UNIT_OF_DISPLACEMENT,
    UNIT_OF_FORCE,
    find_implausible,
    find_wrong_units,
)
from elastocal.identification.mistakes.undoing import PARTED, READ_SO, find_undone
from elastocal.identification.options import FitOptions
from elastocal.identification.tip_place import as_described

IN_SPITE = Kind("calibration.fitted-in-spite", "fitted in spite of this: {error}")
POORLY_FITTED = Kind(
    "calibration.poorly-fitted",
    "the springs leave {left} of the median deflection unexplained",
    shown={"left": as_number(".0%")},
)
DOUBTED = Kind("calibration.doubted", "{doubt} (`import` said so of the logs)")
SURELY_DOUBTED = Kind(
    "calibration.surely-doubted",
    "{doubt} (`import` said so of the logs; by the readings alone: {named})",
    grade=Grade.REFUSAL,
)
_OTHER_NAMES = {
    each.name for each in (READ_SO, PARTED, UNIT_OF_FORCE, UNIT_OF_DISPLACEMENT, COUNTS)
}
"""Kinds that name a mistake by its effect on the readings, of which the logs show more."""


def find_mistakes(
    model: ElasticModel,
    readings: Readings,
    options: FitOptions,
    marker_offset: ArrayLike | None = None,
) -> tuple[Finding, ...]:
    """Return the mistakes that readings seem to contain, or refuse them.

    Parameters
    ----------
    model : ElasticModel
        Robot and springs, by which conventions are checked.
    readings : Readings
        With joints in the robot's order.
    options : FitOptions
        Whether conventions are trusted, and what is known of a contact or a frame.
    marker_offset : array_like, shape (3,), optional
        Marker in the tcp frame, in m.

    Raises
    ------
    DatasetError
        If joints are outside the robot's limits or elsewhere than the recorded positions.
    ConventionError
        With the first mistake that is certain, unless the options trust the conventions.
    """
    if not (doubts := readings.doubts):
        return _found(model, readings, options, marker_offset)
    try:
        found = _found(model, readings, options, marker_offset)
    except ConventionError as error:
        raise ConventionError(SURELY_DOUBTED(doubt="; ".join(doubts), named=str(error))) from error
    others = [each for each in found if each.kind not in _OTHER_NAMES]
    return (*(DOUBTED(doubt=each) for each in doubts), *others)


def _found(
    model: ElasticModel,
    readings: Readings,
    options: FitOptions,
    marker_offset: ArrayLike | None,
) -> tuple[Finding, ...]:
    """Return the mistakes that the readings show, or refuse them; see `find_mistakes`."""
    seen = _implausible(model, readings, marker_offset)
    # Recorded positions of the tcp are of the description.
    described = as_described(model.robot, options)
    warnings = [*_stated(seen, options), *check_joints(described, readings)]
    warnings += _fitted_mistakes(model, readings, options, marker_offset, seen)
    try:
        left = check_conventions(model, readings, marker_offset, options)
    except ConventionError as error:
        if not options.trust_conventions:
            raise
        return (*warnings, IN_SPITE(error=str(error)))
    return (*warnings, POORLY_FITTED(left=left)) if left > POOR_FIT else tuple(warnings)


def _implausible(
    model: ElasticModel, readings: Readings, marker_offset: ArrayLike | None
) -> tuple[Finding, ...]:
    """Return the mistakes that readings show; those by contact are of the tcp, not of a marker."""
    held = readings.by_contact
    if not held.any():
        return find_implausible(model.robot, readings, marker_offset)
    parts = ((readings.take(~held), marker_offset), (readings.take(held), None))
    found = [find_implausible(model.robot, own, at) for own, at in parts if len(own)]
    return tuple(dict.fromkeys(each for part in found for each in part))


def _fitted_mistakes(
    model: ElasticModel,
    readings: Readings,
    options: FitOptions,
    marker_offset: ArrayLike | None,
    seen: Sequence[Finding],
) -> list[Finding]:
    """Return mistakes that fits show, beside those that readings show by themselves."""
    if options.free_frame != "none" or any(each.grade is Grade.REFUSAL for each in seen):
        return []
    held = readings.by_contact
    alike = held.all() or not held.any()
    at = None if held.all() else marker_offset
    found = find_undone(model.robot, readings, at, options.contact) if alike else ()
    if not (seen or found):
        found = tuple(find_wrong_units(model.robot, readings, marker_offset))
    return _stated(found, options)


def _stated(found: Sequence[Finding], options: FitOptions) -> list[Finding]:
    """Return mistakes that readings seem to contain as warnings; refuse them where one is certain.

    Raises
    ------
    ConventionError
        With the first that is certain, unless the options trust the conventions.
    """
    warnings: list[Finding] = []
    for each in found:
        if each.grade is not Grade.REFUSAL:
            warnings.append(each)
        elif options.trust_conventions:
            warnings.append(IN_SPITE(error=each))
        else:
            raise ConventionError(each)
    return warnings
