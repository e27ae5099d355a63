"""What a codec says: saturation of each variant, difference of each pair, and both in words."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.codec.data import CodecData
from elastocal.codec.overlap import Overlap
from elastocal.codec.pairs import Pair, paired
from elastocal.codec.saturation import Saturation, Tolerance, saturation


@dataclass(frozen=True, eq=False)
class Verdicts:
    """The verdicts on a codec."""

    saturation: tuple[Saturation, ...]
    """Of each variant, in order."""
    pairs: tuple[Pair, ...]
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
        saturation(name, values, tolerance, overlap, np.random.default_rng(data.options.seed))
        for name, values in errors.items()
    )
    sizes = {each.variant: each.n_train for each in found}
    pairs = tuple(
        paired(a, b, errors[a], errors[b], overlap, max(sizes[a], sizes[b]))
        for a, b in combinations(errors, 2)
    )
    where = f"{sets} verification set{'s' if sets > 1 else ''} of {size} held-out poses"
    sentences = (
        *(
            _saturation_sentence(each, tolerance, data.errors(each.variant, "max"), where)
            for each in found
        ),
        *(_pair_sentence(each, where) for each in pairs),
    )
    return Verdicts(found, pairs, tolerance, sentences)


def _saturation_sentence(
    found: Saturation, tolerance: Tolerance, largest: FloatArray, where: str
) -> str:
    """Return the verdict on a variant; ``largest`` errors have the shape (cv, n_train)."""
    if found.last == 1:
        return (
            f"{found.variant}: training sets of one pose only ({_um(found.error)}): nothing can be"
            f" said of saturation ({where})"
        )
    worst = largest[:, found.n_train - 1]
    extent = (
        f"largest error with {found.n_train}: {_um(float(np.median(worst)))} in the median set,"
        f" {_um(float(worst.max()))} in the worst; {where}"
    )
    if found.n_train == found.last:
        early = ""
        if found.low is not None and found.low < found.last:
            early = f"; that it has saturated from {found.low} on cannot be ruled out"
        return (
            f"{found.variant}: the error still falls at {found.last} training poses: mean"
            f" {_um(found.last_error)}; more poses may help{early}; {extent}"
        )
    return f"{_reached(found, tolerance)}; {extent}{_doubts(found)}"


def _reached(found: Saturation, tolerance: Tolerance) -> str:
    between = "these sets tell no interval"
    if found.low is not None and found.high is not None:
        between = f"95 % interval {found.low} to {found.high}"
    from_on = f"saturated from {found.n_train} training poses on ({between})"
    if found.stays > found.n_train:
        from_on = (
            f"as good as the last from {found.n_train} training poses ({between}), steadily only"
            f" from {found.stays} on"
        )
    return (
        f"{found.variant}: {from_on}: mean error (median set) {_um(found.error)} there,"
        f" {_um(found.last_error)} with {found.last} (tolerance"
        f" {100.0 * tolerance.relative:.3g} % of that, or {_um(tolerance.floor)})"
    )


def _doubts(found: Saturation) -> str:
    if found.rises:
        return (
            f"; the error rises again: {_um(found.least_error)} with {found.least}: look for a bad"
            " reading, or springs too many for these loads"
        )
    if found.settled or found.high is None:
        return ""
    return f"; that it still falls at {found.last} cannot be ruled out"


def _pair_sentence(pair: Pair, where: str) -> str:
    at = pair.at
    difference, low, high = (float(each[at - 1]) for each in (pair.difference, pair.low, pair.high))
    smaller, larger = (pair.a, pair.b) if difference < 0.0 else (pair.b, pair.a)
    size = f"{at} training pose{'s' if at > 1 else ''}"
    there = f"where both have saturated, with {size}" if at < len(pair.low) else f"with {size}"
    if np.isnan(low):
        return (
            f"{smaller} against {larger}: smaller by {_um(abs(difference))} {there}; the"
            f" verification sets tell no interval ({where})"
        )
    if pair.better is None:
        return (
            f"{pair.a} against {pair.b}: no difference can be told {there} (first minus second,"
            f" mean over the sets: {_um(difference)}, 95 % interval {_um(low)} to {_um(high)};"
            f" {where})"
        )
    ends = sorted((abs(low), abs(high)))
    text = (
        f"{smaller} is better than {larger} by {_um(abs(difference))} (95 % interval"
        f" {_um(ends[0])} to {_um(ends[1])}) {there}, clearly so from {pair.proved_from} on"
    )
    if pair.crossing is not None:
        text += f"; with fewer than {pair.crossing} it is not always so"
    return f"{text} ({where})"


def _um(metres: float) -> str:
    return f"{1e6 * metres:.1f} µm"
