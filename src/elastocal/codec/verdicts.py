"""The verdicts on a codec, and its file ``codec.json`` (docs/reference/files.md).

Each variant is judged by its saturation, each pair by its errors on the same splits.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import combinations
from pathlib import Path

import numpy as np

from elastocal.arrays import BoolArray, FloatArray
from elastocal.codec._overlap import Overlap, corrected_mean, known, micrometres
from elastocal.codec.data import ARRAYS, CodecData, read_codec
from elastocal.codec.indices import Correlation
from elastocal.codec.saturation import Saturation, SaturationInterval, Tolerance, find_saturation
from elastocal.codec.variants import KEYS
from elastocal.errors import SchemaError
from elastocal.records import read_json, record, write_json
from elastocal.results import brief_repr

_ROUND_OFF = 1e-9
"""Part of an error below which a difference is round-off: techniques that choose the same poses
in another order."""
VERDICTS_SCHEMA = "elastocal.codec_verdicts/1"
VERDICTS = "codec.json"
"""Name of the file in a codec's folder."""


@record()
class DifferenceAtSize:
    """The difference of the errors of two variants at one number of training poses."""

    a: str
    b: str
    n_train: int
    difference: float
    """Error of ``a`` minus error of ``b``, mean over the verification sets, in m."""
    low: float | None
    """Ends of the 95 % interval, in m; None where no spread is known."""
    high: float | None


@record()
class PairVerdict:
    """The better one of two variants, and from where on; see `PairedDifference`."""

    a: str
    b: str
    at: int
    """Number of training poses at which the pair is judged: both variants have saturated."""
    better: str | None
    """The variant with the smaller error there; None: cannot be told."""
    proved_from: int | None
    """Number of training poses from which on, up to `at`, every interval says so; None: none."""
    crossing: int | None
    """Number of training poses from which on, up to `at`, the difference keeps its sign; None: it
    has it from the first on, or no difference is left."""


@brief_repr
@dataclass(frozen=True, eq=False)
class PairedDifference:
    """The difference of the errors of two variants, for 1, 2, … training poses."""

    a: str
    b: str
    at: int
    """Number of training poses at which the pair is judged: both variants have saturated."""
    difference: FloatArray
    """Mean over the verification sets of the mean error norm of ``a`` minus that of ``b`` on the
    same set, shape (n_train,), in m; positive: b is better."""
    low: FloatArray
    """Lower ends of the 95 % intervals, in m; NaN where no spread is known."""
    high: FloatArray
    """Upper ends."""

    @property
    def better(self) -> str | None:
        """The variant that is better at `at` training poses; None: cannot be told."""
        if self.low[self.at - 1] > 0.0:
            return self.b
        return self.a if self.high[self.at - 1] < 0.0 else None

    @property
    def proved_from(self) -> int | None:
        """Smallest training set from which on, up to `at`, every interval says so."""
        if self.better is None:
            return None
        clear = self.low > 0.0 if self.better == self.b else self.high < 0.0
        return _since(clear[: self.at])

    @property
    def crossing(self) -> int | None:
        """Smallest training set from which on, up to `at`, the difference keeps its sign.

        None when it has that sign from the first set on, or no difference is left at `at`.
        """
        sign = np.sign(self.difference[: self.at])
        since = _since(sign == sign[-1])
        return None if since == 1 or sign[-1] == 0.0 else since

    def at_each_size(self) -> tuple[DifferenceAtSize, ...]:
        """Return the difference for each number of training poses, as files hold it."""
        rows = zip(self.difference.tolist(), self.low.tolist(), self.high.tolist(), strict=True)
        return tuple(
            DifferenceAtSize(self.a, self.b, n, difference, known(low), known(high))
            for n, (difference, low, high) in enumerate(rows, start=1)
        )

    def verdict(self) -> PairVerdict:
        """Return from where on one of the two is better, as files hold it."""
        return PairVerdict(self.a, self.b, self.at, self.better, self.proved_from, self.crossing)

    def sentence(self, where: str) -> str:
        """Return the verdict at `at` training poses in words.

        Parameters
        ----------
        where : str
            What the figures were measured on.
        """
        at = self.at
        ends = (self.difference, self.low, self.high)
        difference, low, high = (float(each[at - 1]) for each in ends)
        smaller, larger = (self.a, self.b) if difference < 0.0 else (self.b, self.a)
        size = f"{at} training pose{'s' if at > 1 else ''}"
        there = f"where both have saturated, with {size}" if at < len(self.low) else f"with {size}"
        if np.isnan(low):
            return (
                f"{smaller} against {larger}: smaller by {micrometres(abs(difference))} {there};"
                f" the verification sets tell no interval ({where})"
            )
        if self.better is None:
            return (
                f"{self.a} against {self.b}: no difference can be told {there} (first minus second,"
                f" mean over the sets: {micrometres(difference)}, 95 % interval {micrometres(low)}"
                f" to {micrometres(high)}; {where})"
            )
        nearest, farthest = sorted((abs(low), abs(high)))
        text = (
            f"{smaller} is better than {larger} by {micrometres(abs(difference))} (95 % interval"
            f" {micrometres(nearest)} to {micrometres(farthest)}) {there}, clearly so from"
            f" {self.proved_from} on"
        )
        if self.crossing is not None:
            text += f"; with fewer than {self.crossing} it is not always so"
        return f"{text} ({where})"


def paired_difference(
    a: str, b: str, errors_a: FloatArray, errors_b: FloatArray, overlap: Overlap, at: int
) -> PairedDifference:
    """Return the paired difference of two variants.

    Parameters
    ----------
    a, b : str
        Names.
    errors_a, errors_b : ndarray, shape (cv, n_train)
        Mean error norm of each verification set, in m.
    overlap : Overlap
        Of the verification sets.
    at : int
        Number of training poses at which the pair is judged.
    """
    difference = errors_a - errors_b
    round_off = np.abs(difference) <= _ROUND_OFF * np.maximum(errors_a, errors_b)
    found = corrected_mean(np.where(round_off, 0.0, difference), overlap)
    return PairedDifference(a, b, at, found.mean, found.low, found.high)


def _since(holds: BoolArray) -> int:
    """Return the size, from 1, from which on a condition holds that holds at the end."""
    fails = np.flatnonzero(~holds)
    return int(fails[-1]) + 2 if len(fails) else 1


@brief_repr
@dataclass(frozen=True, eq=False)
class Verdicts:
    """The verdicts on a codec."""

    saturation: tuple[Saturation, ...]
    """One for each variant, in order."""
    pairs: tuple[PairedDifference, ...]
    """Every two variants."""
    tolerance: Tolerance
    sentences: tuple[str, ...]
    """One for each variant, then one for each pair."""


@brief_repr
@record()
class Curve:
    """Errors of a variant over the number of training poses."""

    n_train: tuple[int, ...]
    error_mean: tuple[float, ...]
    """Median over the verification sets of the mean error norm, in m."""
    error_max: tuple[float, ...]
    """Median over the verification sets of the largest error norm, in m."""
    search: str
    springs: str
    load_cases: str
    solver: str


@brief_repr
@record()
class CodecSetup:
    """The splits and tolerances that the figures rest on."""

    poses: int
    training: int
    verification: int
    splits: int
    overlap: float
    """Part of its poses that a verification set shares with another one, mean over pairs."""
    ratio: float
    seed: int
    tolerance: float
    floor: float
    load_cases: tuple[str, ...]

    @property
    def sentence(self) -> str:
        """The splits in words."""
        return (
            f"{self.poses} poses, {self.splits} splits into up to {self.training} training and"
            f" {self.verification} verification poses"
        )


@brief_repr
@record(VERDICTS_SCHEMA)
class CodecSummary:
    """The figures of a codec: contents of ``codec.json``, for people's scripts."""

    robot: str
    provenance: str
    settings: CodecSetup
    variants: dict[str, Curve]
    saturation: dict[str, int | None]
    """By variant: smallest number of training poses whose error is that of the last; none for
    springs that leave more than half of what no model at all leaves."""
    saturation_interval: dict[str, SaturationInterval]
    paired: tuple[DifferenceAtSize, ...]
    crossings: tuple[PairVerdict, ...]
    indices: tuple[Correlation, ...]
    """Rank correlations of indices with accuracy; empty where they were not asked for."""
    sentences: tuple[str, ...]
    """The verdicts in words: one for each variant, then one for each pair."""
    findings: tuple[str, ...]
    """Notes on the data."""
    versions: dict[str, str]


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
        find_saturation(
            name,
            values,
            tolerance,
            overlap,
            np.random.default_rng(data.options.seed),
            data.zero_error,
        )
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


def codec_summary(
    data: CodecData, verdicts: Verdicts, correlations: Sequence[Correlation] = ()
) -> CodecSummary:
    """Return the figures of a codec, its verdicts, and correlations of indices if there are."""
    interval = [each.name for each in fields(SaturationInterval)]
    return CodecSummary(
        robot=data.robot,
        provenance=data.provenance,
        settings=_setup(data, verdicts.tolerance),
        variants={each.name: _curve(data, each.name) for each in data.variants},
        saturation={
            each.variant: each.n_train if each.explains else None for each in verdicts.saturation
        },
        saturation_interval={
            each.variant: SaturationInterval(**{name: getattr(each, name) for name in interval})
            for each in verdicts.saturation
        },
        paired=tuple(one for pair in verdicts.pairs for one in pair.at_each_size()),
        crossings=tuple(pair.verdict() for pair in verdicts.pairs),
        indices=tuple(correlations),
        sentences=verdicts.sentences,
        findings=data.findings,
        versions=data.versions,
    )


def write_codec_summary(folder: Path, result: CodecSummary) -> Path:
    """Write ``codec.json`` into a folder, atomically; return its path.

    Raises
    ------
    FileAccessError
        If it cannot be written.
    """
    path = Path(folder) / VERDICTS
    write_json(path, result)
    return path


def read_codec_summary(path: Path) -> CodecSummary:
    """Return the validated contents of a ``codec.json``.

    Raises
    ------
    SchemaError
        If it is not JSON, has another schema or does not fit.
    FileAccessError
        If it cannot be read.
    """
    return read_json(path, CodecSummary)


def read_codec_folder(folder: Path) -> tuple[CodecData, CodecSummary]:
    """Return arrays and result of a codec's folder.

    Raises
    ------
    SchemaError
        If a file is damaged, or the two are not of one codec.
    FileAccessError
        If one cannot be read.
    """
    data, result = read_codec(folder), read_codec_summary(Path(folder) / VERDICTS)
    names = [each.name for each in data.variants]
    if names != list(result.variants) or len(data.contact) != result.settings.poses:
        raise SchemaError(f"{folder}: {ARRAYS} and {VERDICTS} are of different codecs")
    return data, result


def _setup(data: CodecData, tolerance: Tolerance) -> CodecSetup:
    sets, size = data.verification.shape
    return CodecSetup(
        poses=len(data.contact),
        training=data.training_poses,
        verification=size,
        splits=sets,
        overlap=Overlap.of(data.verification, len(data.contact)).shared,
        ratio=data.options.ratio,
        seed=data.options.seed,
        tolerance=tolerance.relative,
        floor=tolerance.floor,
        load_cases=data.load_cases,
    )


def _curve(data: CodecData, name: str) -> Curve:
    variant = data.variants[data.index(name)]
    return Curve(
        tuple(data.n_train.tolist()),
        tuple(np.median(data.errors(name, "mean"), axis=0).tolist()),
        tuple(np.median(data.errors(name, "max"), axis=0).tolist()),
        **{key: getattr(variant, key) for key in KEYS},
    )
