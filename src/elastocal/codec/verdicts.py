"""What a codec says: saturation of each variant, difference of each pair, and both in words."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from elastocal.codec._overlap import Overlap
from elastocal.codec.data import CodecData
from elastocal.codec.paired_differences import PairedDifference, paired_difference
from elastocal.codec.saturation import Saturation, Tolerance, find_saturation


@dataclass(frozen=True, eq=False)
class Verdicts:
    """The verdicts on a codec."""

    saturation: tuple[Saturation, ...]
    """Of each variant, in order."""
    pairs: tuple[PairedDifference, ...]
    """Every two variants."""
    tolerance: Tolerance
    sentences: tuple[str, ...]
    """One for each variant, then one for each pair."""


def judge(data: CodecData, tolerance: Tolerance | None = None) -> Verdicts:
    """Return the verdicts on a codec, by the mean error norm of each verification set.

    Intervals are seeded with the codec's own seed.

    Parameters
    ----------
    data : CodecData
        The arrays.
    tolerance : Tolerance, optional
        How near to the last error counts as saturated.
    """
    tolerance = tolerance or Tolerance()
    sets, size = data.verification.shape
    overlap = Overlap.of(data.verification, len(data.contact))
    errors = {each.name: data.errors(each.name) for each in data.variants}
    found = tuple(
        find_saturation(name, values, tolerance, overlap, np.random.default_rng(data.options.seed))
        for name, values in errors.items()
    )
    sizes = {each.variant: each.n_train for each in found}
    pairs = tuple(
        paired_difference(a, b, errors[a], errors[b], overlap, max(sizes[a], sizes[b]))
        for a, b in combinations(errors, 2)
    )
    where = f"{sets} verification set{'s' if sets > 1 else ''} of {size} held-out poses"
    sentences = (
        *(each.sentence(tolerance, data.errors(each.variant, "max"), where) for each in found),
        *(each.sentence(where) for each in pairs),
    )
    return Verdicts(found, pairs, tolerance, sentences)
