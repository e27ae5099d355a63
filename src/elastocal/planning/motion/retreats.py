"""Whether the straight ways between contact and approach pose are free of collision, all along."""

import math

import numpy as np

from elastocal.arrays import BoolArray
from elastocal.cell import Cell
from elastocal.planning.motion.mover import Mover
from elastocal.planning.postures import Postures
from elastocal.planning.retreat import on_the_way

_STEP = 2e-3
"""Distance in m between the places that are looked at; a body that keeps half of it more than the
clearance at both ends of a step keeps the clearance in between."""


def clear_retreats(cell: Cell, mover: Mover, postures: Postures) -> BoolArray:
    """Return whether each posture's way off the surface is free, shape (pose,).

    The pool's collision check looks at a few places; this one at every 2 mm, and is asked of the
    chosen poses only. Below the near-contact pose the tool is not checked against what it presses
    on; above it, it must keep as much as it is above it, up to the clearance.

    Parameters
    ----------
    cell : Cell
        For its distances.
    mover : Mover
        With the scene and the clearance.
    postures : Postures
        In contact.
    """
    scene, clearance = mover.sweep.scene, mover.sweep.clearance
    approach, near = cell.file.engagement.approach_distance, cell.file.engagement.near_contact
    left = np.arange(len(postures))
    for part in np.linspace(0.0, 1.0, math.ceil(approach / _STEP) + 1):
        above = part * approach - near
        pressed = -math.inf if above < 0.0 else min(clearance, above)
        q = on_the_way(scene.robot, postures.take(left), float(part))
        left = left[scene.keeps(q, clearance + 0.5 * _STEP, pressed)]
    clear = np.zeros(len(postures), dtype=bool)
    clear[left] = True
    return clear
