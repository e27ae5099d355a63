"""What a codec says: saturation of each variant, difference of each pair, and both in words."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from elastocal.codec.data import CodecData
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
    shared = size / data.training_poses
    errors = {each.name: data.errors(each.name) for each in data.variants}
    found = tuple(
        saturation(name, values, tolerance, shared, np.random.default_rng(data.options.seed))
        for name, values in errors.items()
    )
    pairs = tuple(paired(a, b, errors[a], errors[b], shared) for a, b in combinations(errors, 2))
    where = f"{sets} verification set{'s' if sets > 1 else ''} of {size} held-out poses"
    sentences = (
        *(_saturation_sentence(each, tolerance, where) for each in found),
        *(_pair_sentence(each, where) for each in pairs),
    )
    return Verdicts(found, pairs, tolerance, sentences)


def _saturation_sentence(found: Saturation, tolerance: Tolerance, where: str) -> str:
    between = "no interval from one set"
    if found.low is not None and found.high is not None:
        between = f"95 % interval {found.low} to {found.high}"
    reach = f"within {tolerance.relative:.0%} or {_um(tolerance.floor)} of the last"
    if found.n_train == found.last:
        return (
            f"{found.variant}: the error still falls at {found.last} training poses"
            f" ({_um(found.last_error)}): more poses would help ({where})"
        )
    text = (
        f"{found.variant}: saturated from {found.n_train} training poses on ({between}):"
        f" {_um(found.error)} there, {_um(found.last_error)} with {found.last}, {reach};"
        f" medians of the mean error over {where}"
    )
    if found.settled or found.high is None:
        return text
    return f"{text}; that it still falls at {found.last} cannot be ruled out"


def _pair_sentence(pair: Pair, where: str) -> str:
    last = len(pair.difference)
    difference, low, high = (float(each[-1]) for each in (pair.difference, pair.low, pair.high))
    if np.isnan(low):
        better, worse = (pair.a, pair.b) if difference < 0.0 else (pair.b, pair.a)
        return (
            f"{better} against {worse}: smaller by {_um(abs(difference))} with {last} training"
            f" poses; one verification set tells no interval ({where})"
        )
    if pair.better is None:
        return (
            f"{pair.a} against {pair.b}: no difference can be told with {last} training poses"
            f" ({_um(difference)}, 95 % interval {_um(low)} to {_um(high)}; {where})"
        )
    worse = pair.a if pair.better == pair.b else pair.b
    ends = sorted((abs(low), abs(high)))
    text = (
        f"{pair.better} is better than {worse} by {_um(abs(difference))} (95 % interval"
        f" {_um(ends[0])} to {_um(ends[1])}) with {last} training poses, clearly so from"
        f" {pair.proved_from} on"
    )
    if pair.crossing is not None:
        text += f"; with fewer than {pair.crossing} it is not"
    return f"{text} ({where})"


def _um(metres: float) -> str:
    return f"{1e6 * metres:.1f} um"
