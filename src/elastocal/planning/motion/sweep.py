"""Whether straight moves in joint space are free of collision, between samples too."""

from dataclasses import dataclass, field

import numpy as np

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.planning.motion.radii import joint_radii
from elastocal.planning.scene import CollisionScene

COARSEST = 0.064
"""Length in m of the pieces that a move is first cut into: how far its points may move. The
wrists of KUKA's arms keep 20 to 60 mm between links 4 and 6: longer pieces are cut anyway."""
GLANCE = 0.5
"""Length in m of the pieces at whose middles a move is looked at first."""
FINEST = 1e-3
"""Length in m of a piece that is not cut any more."""


@dataclass(frozen=True, eq=False)
class Sweep:
    """Conservative advancement over moves, level by level (after Schwarzer, Saha, Latombe 2005).

    Within a piece of length ``L`` no point is farther than ``L / 2`` from where it is at the
    piece's middle (`joint_radii`). If all bodies keep ``clearance + L / 2`` there, they keep the
    clearance all along the piece; else it is cut in two. A move is blocked when a middle does not
    keep the clearance, or a piece of the finest length is undecided.
    """

    scene: CollisionScene
    clearance: float
    """Distance in m that bodies must keep all along a move."""
    radii: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        radii = joint_radii(self.scene.robot, self.scene.tool)
        radii.setflags(write=False)
        object.__setattr__(self, "radii", radii)

    def free(self, start: FloatArray, end: FloatArray) -> BoolArray:
        """Return whether moves are free of collision, all along.

        Parameters
        ----------
        start, end : ndarray, shape (move, joint)
            Joint positions in rad or m.

        Returns
        -------
        ndarray of bool, shape (move,)
            False also for moves that pass within half a `FINEST` of the clearance.
        """
        travel = end - start
        bound = np.abs(travel) @ self.radii
        # A look at a few postures first: most moves that are blocked are so for a long way.
        move, middle, _ = _cut(bound, np.arange(len(start)), GLANCE)
        seen = self.scene.keeps(start[move] + middle[:, None] * travel[move], self.clearance)
        blocked = np.zeros(len(start), dtype=bool)
        blocked[move[~seen]] = True
        move, middle, width = _cut(bound, np.flatnonzero(~blocked), COARSEST)
        length = COARSEST
        while len(move):
            q = start[move] + middle[:, None] * travel[move]
            open_ = ~self.scene.keeps(q, self.clearance + 0.5 * length)
            move, middle, q = move[open_], middle[open_], q[open_]
            if length <= FINEST:
                blocked[move] = True
                break
            blocked[move[~self.scene.keeps(q, self.clearance)]] = True
            left = ~blocked[move]
            move, middle, width = move[left], middle[left], 0.5 * width[open_][left]
            length *= 0.5
            middle = (middle[:, None] + 0.5 * width[:, None] * np.array([-1.0, 1.0])).ravel()
            move, width = np.repeat(move, 2), np.repeat(width, 2)
        return ~blocked

    def along(self, postures: FloatArray) -> bool:
        """Return whether a chain of straight moves is free of collision.

        Parameters
        ----------
        postures : ndarray, shape (posture, joint)
            Joint positions in rad or m, start and end included.
        """
        return bool(self.free(postures[:-1], postures[1:]).all())


def _cut(
    bound: FloatArray, moves: IndexArray, length: float
) -> tuple[IndexArray, FloatArray, FloatArray]:
    """Return move, middle and width of the pieces of some moves; the latter as parts of the move.

    ``bound`` is how far the points of each move may move; no piece is longer than ``length``.
    """
    pieces = np.ceil(bound[moves] / length).astype(int).clip(min=1)
    width = np.repeat(1.0 / pieces, pieces)
    number = np.arange(len(width)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    return np.repeat(moves, pieces), (number + 0.5) * width, width
