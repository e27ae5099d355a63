"""Which poses verify and which may train (paper Algorithm 1, lines 2 to 7)."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.codec.options import RATIO
from elastocal.errors import CodecError
from elastocal.planning.search import Candidates, Cover


@dataclass(frozen=True, eq=False)
class Split:
    """One verification set and what is left to train with."""

    seed_pose: int
    """Number of the pose that the set was grown from."""
    verification: IndexArray
    """Numbers of the verification poses in the order of choice, shape (N_v,)."""
    training: IndexArray
    """Numbers of the others, rising, shape (N_c,)."""


def split_sizes(poses: int, ratio: float = RATIO) -> tuple[int, int]:
    """Return the numbers of training and of verification poses, ``N_c`` and ``N_v``.

    ``N_c = round(N r / (r + 1))``, a half to the even number; ``N_v = N - N_c``.

    >>> split_sizes(31)
    (22, 9)

    Raises
    ------
    CodecError
        If a side of the split has no pose.
    """
    training = round(poses * ratio / (ratio + 1.0))
    if not 1 <= training < poses:
        raise CodecError(
            f"{poses} poses split {ratio:.3g} to 1 give {training} training and"
            f" {poses - training} verification poses: at least 1 of each is needed"
        )
    return training, poses - training


def make_splits(contact: FloatArray, count: int | None, verification: int) -> tuple[Split, ...]:
    """Return splits whose verification sets are COVER sets grown from different poses.

    Parameters
    ----------
    contact : ndarray, shape (pose, 3)
        Contact points, in m.
    count : int, optional
        Number ``N_cv`` of splits, grown from the poses 0 to ``N_cv - 1``; default: as many as
        there are poses.
    verification : int
        Poses in each verification set, ``N_v``.

    Raises
    ------
    CodecError
        If there are fewer poses than splits, or less than one split is wanted.
    """
    pool = Candidates(contact)
    count = len(pool) if count is None else count
    if not 1 <= count <= len(pool):
        raise CodecError(
            f"{count} splits wanted, each grown from a pose of its own: must be from 1 to the"
            f" {len(pool)} poses of the dataset"
        )
    return tuple(_split(pool, seed, verification) for seed in range(count))


def _split(pool: Candidates, seed: int, size: int) -> Split:
    chosen = Cover(first=seed).search(pool, size).order
    left = np.ones(len(pool), dtype=bool)
    left[chosen] = False
    return Split(seed, chosen, np.flatnonzero(left))
