"""Move labels apart until none covers another."""

import numpy as np

from elastocal.arrays import FloatArray

_ROUNDS = 200
_PULL = 0.02
"""Part of its way back to its anchor that a label is drawn in each round."""
_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))
"""Turn between the first steps of labels that share an anchor, in rad."""


def spread(anchor: FloatArray, distance: float) -> FloatArray:
    """Return places near their anchors that keep a distance from one another, shape (label, 2).

    Labels that are far enough apart stay where they are. Crowded ones push each other away and
    are pulled back, round by round; the same anchors give the same places.

    Parameters
    ----------
    anchor : ndarray, shape (label, 2)
        Where the labels belong.
    distance : float
        To keep between two labels, in the unit of the anchors.
    """
    count = len(anchor)
    angle = _GOLDEN * np.arange(count)
    nudge = 1e-3 * distance * np.column_stack([np.cos(angle), np.sin(angle)])
    gap = np.linalg.norm(anchor[:, None] - anchor[None], axis=2) + distance * np.eye(count)
    crowded = (gap < distance).any(axis=1, keepdims=True)
    place = np.where(crowded, anchor + nudge, anchor)
    for number in range(_ROUNDS):
        pull = _PULL if number < 0.8 * _ROUNDS else 0.0
        step = _pushes(place, distance) + pull * (anchor - place)
        if not np.any(step):
            break
        place = place + step
    return place


def _pushes(place: FloatArray, distance: float) -> FloatArray:
    """Return how far each label is pushed by those that are too near, shape (label, 2)."""
    offset = place[:, None] - place[None]
    gap = np.linalg.norm(offset, axis=2)
    np.fill_diagonal(gap, np.inf)
    lacking = np.clip(distance - gap, 0.0, None)
    weight = np.where(lacking > 0.0, 0.5 * lacking / np.maximum(gap, 1e-12), 0.0)
    pushes: FloatArray = np.einsum("ab,abi->ai", weight, offset)
    return pushes
