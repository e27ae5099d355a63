"""What a reader of a comparison has to know beside the figures."""

import re

import numpy as np

from elastocal.identification.calibrated import CalibratedModel

_PLAN = re.compile(r"\bplan ([0-9a-f]{12,})\b")
_LIKE = 1.25
"""Mean measured deflections further apart than by this factor come from other loads."""


def caveats(
    old: CalibratedModel, new: CalibratedModel, same_springs: bool, outside: int
) -> tuple[str, ...]:
    """Return the sentences.

    Parameters
    ----------
    old, new : CalibratedModel
        What is compared.
    same_springs : bool
        Whether the models have the same springs.
    outside : int
        Number of rows outside the joint limits.
    """
    notes = []
    if not same_springs:
        notes.append(
            "the models have different springs: a spring's value depends on which others are in the"
            " model, so the springs do not tell whether the robot changed; predictions do, as far"
            " as both models can express the arm"
        )
    if old.provenance and old.provenance == new.provenance:
        notes.append(
            f"both models state the same origin ({old.provenance}): calibrations of one set of"
            " readings are not independent, and the intervals do not hold for them"
        )
    elif not _same_plan(old, new):
        notes.append(
            "the models do not state one and the same plan: the intervals hold if both calibrations"
            " spread their poses over the same region under the same forces; elsewhere the arm does"
            " what springs cannot express, and this looks like a change"
        )
    if outside:
        notes.append(f"{outside} rows lie outside the joint limits of the robot")
    return tuple(notes)


def load_caveat(old: float | None, new: float | None) -> str | None:
    """Return what other loads do to a comparison, or None where they were alike.

    Parameters
    ----------
    old, new : float, optional
        Mean measured deflection of each calibration, in m; None: not known.
    """
    if old is None or new is None or not (old > 0.0 and new > 0.0):
        return None
    if not abs(np.log(new / old)) > np.log(_LIKE):
        return None
    return (
        f"the arm was deflected by {1e3 * old:.3f} mm on average in the old calibration and by"
        f" {1e3 * new:.3f} mm in the new one: with other forces gears that stiffen under load look"
        " like a change"
    )


def _same_plan(old: CalibratedModel, new: CalibratedModel) -> bool:
    plans = [_PLAN.search(each.provenance) for each in (old, new)]
    return plans[0] is not None and plans[1] is not None and plans[0][1] == plans[1][1]
