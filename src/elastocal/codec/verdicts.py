"""The verdicts on a codec, and its file ``codec.json`` (docs/reference/files/codec.md).

Each variant is judged by its saturation, each pair by its errors on the same held-out poses.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from itertools import combinations
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.codec.data import ARRAYS, CodecData, read_codec
from elastocal.codec.indices import Correlation
from elastocal.codec.pairs import (
    DifferenceAtSize,
    PairedDifference,
    PairVerdict,
    compare_variants,
)
from elastocal.codec.saturation import Saturation, SaturationInterval, Tolerance, find_saturation
from elastocal.codec.variants import KEYS
from elastocal.errors import SchemaError
from elastocal.findings import Finding
from elastocal.identification import Overlap, RungSummary, ladder_sentence
from elastocal.records import read_json, record, write_json
from elastocal.results import brief_repr
from elastocal.wording import counted

VERDICTS_SCHEMA = "elastocal.codec_verdicts/2"
"""Schema of the verdicts of a codec."""
VERDICTS = "codec.json"
"""Name of the file in a codec's folder."""
_AS_CALIBRATE = "springs, as calibrate judges, with each pose left out in turn: "


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
    springs: tuple[str, ...] = ()
    """Springs that the readings support, as `calibrate` states, then the springs of variants that
    leave the choice to the readings; empty in older codecs."""


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
    layout: str = ""
    """Springs that `calibrate` takes on this file for the word in ``springs``."""
    layouts: dict[str, int] = field(default_factory=dict)
    """Springs behind the errors at the largest training sets, with the number of splits whose
    training poses chose them."""


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
@record(VERDICTS_SCHEMA, sealed=True, reads=("elastocal.codec_verdicts/1",))
class CodecSummary:
    """Figures of a codec: contents of ``codec.json``, for scripts of users."""

    robot: str
    provenance: str
    settings: CodecSetup
    variants: dict[str, Curve]
    saturation: dict[str, int | None]
    """By variant: smallest number of training poses whose error equals the last within the
    tolerance; None for springs that leave more than half of the error without any model."""
    saturation_interval: dict[str, SaturationInterval]
    paired: tuple[DifferenceAtSize, ...]
    crossings: tuple[PairVerdict, ...]
    indices: tuple[Correlation, ...]
    """Rank correlations of indices with accuracy; empty where they were not asked for."""
    sentences: tuple[str, ...]
    """The verdicts in words: one for each variant, then one for each pair."""
    findings: tuple[Finding, ...]
    """Notes on the data."""
    versions: dict[str, str]
    ladder: tuple[RungSummary, ...] = ()
    """The ladder of `calibrate` on this file, and other compared layouts."""
    springs: tuple[str, ...] = ()
    """The ladder in words, as `calibrate` says it, and what variants took that leave their springs
    to the readings."""


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
        compare_variants(
            a, b, errors[a], errors[b], overlap, max(sizes[a], sizes[b]), _left_out(data, a, b)
        )
        for a, b in combinations(errors, 2)
    )
    where = f"{sets} verification set{'s' if sets > 1 else ''} of {size} poses"
    sentences = (
        *(each.sentence(tolerance, data.errors(each.variant, "max"), where) for each in found),
        *(each.sentence(where) for each in pairs),
    )
    return Verdicts(found, pairs, tolerance, sentences, _springs(data))


def _springs(data: CodecData) -> tuple[str, ...]:
    """Return the springs that readings and splits carry, in words."""
    found = [_AS_CALIBRATE + ladder_sentence(data.ladder)] if data.ladder else []
    rows = zip(data.variants, data.layouts, data.split_layouts, strict=True)
    for variant, layout, splits in rows:
        if variant.springs != layout:
            found.append(
                f"{variant.name}: springs {variant.springs} are {layout} on these readings; its"
                " errors are those of springs chosen in each split from its training poses alone:"
                f" {_chosen_by_size(splits)}"
            )
    return tuple(found)


def _chosen_by_size(splits: Sequence[Sequence[str]]) -> str:
    """Return how many splits chose which springs, at each size where the numbers change."""
    sizes = list(zip(*splits, strict=True))
    changes = [0, *(n for n in range(1, len(sizes)) if sizes[n] != sizes[n - 1])]
    return "; ".join(
        f"with {counted(n + 1, 'pose')} "
        + ", ".join(f"{name} in {k}" for name, k in Counter(sizes[n]).most_common())
        + (" splits" if n == 0 else "")
        for n in changes
    )


def _left_out(data: CodecData, a: str, b: str) -> FloatArray | None:
    """Return the errors at left-out poses of two variants that differ in their springs alone."""
    i, j = data.index(a), data.index(b)
    if data.left_out is None or data.variants[i].springs == data.variants[j].springs:
        return None
    return data.left_out[[i, j]]


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
        ladder=data.ladder,
        springs=verdicts.springs,
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
    number = data.index(name)
    variant = data.variants[number]
    return Curve(
        tuple(data.n_train.tolist()),
        tuple(np.median(data.errors(name, "mean"), axis=0).tolist()),
        tuple(np.median(data.errors(name, "max"), axis=0).tolist()),
        **{key: getattr(variant, key) for key in KEYS},
        layout=data.layouts[number],
        layouts=dict(Counter(each[-1] for each in data.split_layouts[number])),
    )
