"""Repeated cross-validation over growing training sets (paper 3.2, Algorithm 1).

Each variant on each split: choose, fit, verify (lines 8 to 18).
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike

from elastocal._version import package_versions
from elastocal.arrays import FloatArray, IndexArray
from elastocal.codec._prepared import (
    Entrant,
    PreparedVariant,
    climbed_ladder,
    left_out_errors,
    make_entrant,
    taken_springs,
)
from elastocal.codec.data import NO_POSE, CodecData, SpringLabels
from elastocal.codec.splits import (
    CodecOptions,
    Split,
    drawn_poses,
    make_campaign,
    make_splits,
    split_sizes,
)
from elastocal.codec.variants import Variant, check_different
from elastocal.dataset import Readings
from elastocal.errors import CodecError, IdentificationError
from elastocal.findings import Finding, Kind
from elastocal.identification import MINIMUM_BLOCKS, Problem, rung_summary, solve, with_references
from elastocal.parallel import map_in_processes, one_blas_thread, process_count
from elastocal.planning.search import Candidates, growing_choices, technique
from elastocal.progress import Progress, silent
from elastocal.robot import Robot

_STAGE = "splits"
_WORTH_PROCESSES = 4.0
"""Processor time from which on all cores are used, in s; processes need half of it to start."""
_GROWTH = 1.8
"""Ratio of training sizes at which springs are chosen again."""


@dataclass(frozen=True, eq=False)
class _LearningCurve:
    """Choices, fits and errors of a variant on a split, for 1, 2, … training poses."""

    springs: tuple[str, ...]
    """Names of the springs behind the errors, by number of training poses."""
    chosen: tuple[IndexArray, ...]
    """Numbers of the training poses, in the order of choice."""
    compliance: FloatArray
    """Compliances of the springs that the file carries, shape (n_train, spring), in rad/(N·m) or
    m/N."""
    error_mean: FloatArray
    """Mean absolute residual at the verification poses, shape (n_train, 4), in m; see `AXES`."""
    error_max: FloatArray
    """Largest absolute residual, of the same shape and unit."""


@one_blas_thread()
def cross_validate(
    robot: Robot,
    readings: Readings,
    variants: Sequence[Variant] = (Variant(),),
    options: CodecOptions | None = None,
    *,
    marker_offset: ArrayLike | None = None,
    provenance: str = "",
    jobs: int | None = None,
    progress: Progress = silent,
) -> CodecData:
    """Return the errors at held-out poses of growing training sets, for every variant.

    Parameters
    ----------
    readings : Readings
        Measurements, joints in the robot's order; from `Dataset.readings`.
    variants : sequence of Variant
        What to compare; all see the same splits.
    options : CodecOptions, optional
        Number of splits, ratio, seed.
    marker_offset : array_like, shape (3,), optional
        Metrology marker in the tcp frame, in m.
    provenance : str
        Where the readings came from; kept with the arrays.
    jobs : int, optional
        Processes; default: one, but all cores where the splits take one process long. The
        numbers do not depend on it.
    progress : Progress, optional
        Hears of each split that is done.

    Raises
    ------
    CodecError
        If there are too few poses for a split or as many splits, two variants are the same, or
        one fits nothing.
    DatasetError
        If the data lack a load case, or joints are not this robot's.
    IdentificationError
        If the data hold fewer than three poses; a `ConventionError` if they fit only with a
        sign or frame read otherwise.
    """
    options = options or CodecOptions()
    measured, readings = readings, with_references(robot, drawn_poses(readings, options))
    ladder = climbed_ladder(robot, readings, variants, options, marker_offset)
    taken = [taken_springs(ladder, each.springs) for each in variants]
    models = {each.name: each.model for each in ladder.ladder}
    compared = [models[name] for name in dict.fromkeys(taken)]
    campaign = make_campaign(compared, readings, options, marker_offset)
    check_different(variants, campaign.load_cases)
    training, verification = split_sizes(len(campaign), options.ratio)
    splits = make_splits(campaign.contact, options.splits, verification, campaign.company)
    training = max(training, len(splits[0].training))
    entrants = [
        make_entrant(each, name, models, campaign, options, marker_offset)
        for each, name in zip(variants, taken, strict=True)
    ]
    prepared = [each.taken for each in entrants]
    most = min(_largest_training_set(each, splits) for each in prepared)
    drawn = _draw_findings(measured, readings, options)
    findings = [*drawn, *campaign.findings, *ladder.refused]
    if most < training:
        findings.append(TRAINING_ENDS(most=most, training=training))
    curves = _run_splits(entrants, splits, most, options.seed, jobs, progress)
    for each, found in zip(prepared, curves, strict=True):
        _require_a_fit(each, found)
    return CodecData(
        variants=tuple(variants),
        springs=tuple(SpringLabels.of(models[name].springs) for name in taken),
        pose_labels=campaign.labels,
        contact=campaign.contact,
        seed_pose=np.array([split.seed_pose for split in splits]),
        verification=np.array([split.verification for split in splits]),
        chosen=np.array([[_padded(each.chosen) for each in found] for found in curves]),
        compliance=tuple(np.array([each.compliance for each in found]) for found in curves),
        error_mean=np.array([[each.error_mean for each in found] for found in curves]),
        error_max=np.array([[each.error_max for each in found] for found in curves]),
        load_cases=campaign.load_cases,
        options=options,
        robot=robot.name,
        provenance=provenance,
        findings=tuple(findings),
        versions=package_versions(),
        zero_error=np.array([_zero_error(prepared[0].problem, split) for split in splits]),
        layouts=tuple(taken),
        split_layouts=tuple(tuple(each.springs for each in found) for found in curves),
        ladder=tuple(map(rung_summary, ladder.ladder)),
        left_out=left_out_errors(ladder, variants),
    )


DRAWN = Kind(
    "codec.poses-drawn",
    "made on {poses} of the {of} poses, drawn with seed {seed}: work and memory grow with"
    " the cube of their number (--poses takes more)",
)
TRAINING_ENDS = Kind(
    "codec.training-ends",
    "training sets end at {most} of {training} poses: the others have no reading of the"
    " load cases that a variant trains with",
)


def _draw_findings(measured: Readings, drawn: Readings, options: CodecOptions) -> list[Finding]:
    """Return a warning about a codec that was not made on all poses."""
    poses, of = (len(np.unique(readings.pose)) for readings in (drawn, measured))
    if poses == of:
        return []
    return [DRAWN(poses=poses, of=of, seed=options.seed)]


def _zero_error(problem: Problem, split: Split) -> float:
    """Return the mean deflection at the verification poses: the error without any model."""
    verified = np.isin(problem.block, split.verification)
    return float(np.linalg.norm(problem.d[verified], axis=1).mean())


def _largest_training_set(prepared: PreparedVariant, splits: Sequence[Split]) -> int:
    """Return the largest training set that every split can give a variant."""
    most = min(len(prepared.can_train(split)) for split in splits)
    if most < 1:
        variant = prepared.variant
        raise CodecError(
            f"variant {variant.name!r} fits nothing: a split leaves it no training pose"
            f" with a reading of load cases {variant.load_cases!r}"
        )
    return most


def _run_splits(
    entrants: Sequence[Entrant],
    splits: Sequence[Split],
    most: int,
    seed: int,
    jobs: int | None,
    progress: Progress,
) -> list[list[_LearningCurve]]:
    """Return the learning curves by variant and split.

    The duration of the first split decides whether the others run in parallel.
    """
    run = partial(_run_split, entrants, most, seed)
    progress(_STAGE, 0, len(splits))
    begin = time.process_time()
    found = [run(splits[0])]
    others = (len(splits) - 1) * (time.process_time() - begin)
    processes = process_count(jobs or None, len(splits), worthwhile=others > _WORTH_PROCESSES)
    progress(_STAGE, 1, len(splits))
    for curves in map_in_processes(run, splits[1:], processes):
        found.append(curves)
        progress(_STAGE, len(found), len(splits))
    return [list(column) for column in zip(*found, strict=True)]


def _run_split(
    entrants: Sequence[Entrant], most: int, seed: int, split: Split
) -> list[_LearningCurve]:
    """Return the learning curve of each variant on one split."""
    curves = []
    # Variants that differ in their search alone choose the same springs on the same poses.
    known: dict[tuple[str, ...], dict[frozenset[int], str]] = {}
    for each in entrants:
        variant = each.taken.variant
        found = known.setdefault((variant.springs, variant.load_cases, variant.solver), {})
        try:
            curves.append(_train(each, found, split, most, seed))
        except IdentificationError as error:
            raise IdentificationError(
                f"variant {variant.name!r}, split grown from pose {split.seed_pose}: {error}"
            ) from error
    return curves


def _chosen_springs(
    entrant: Entrant, known: dict[frozenset[int], str], poses: IndexArray
) -> PreparedVariant:
    """Return a variant with the springs that training poses carry, known or judged now."""
    key = frozenset(poses.tolist())
    if key not in known:
        known[key] = entrant.chosen(np.sort(poses))
    return entrant.with_springs(known[key])


def _require_a_fit(prepared: PreparedVariant, curves: Sequence[_LearningCurve]) -> None:
    """Refuse a variant whose largest training sets leave every spring at a bound."""
    last = np.array([curve.compliance[-1] for curve in curves])
    problem = prepared.problem
    lower, upper = problem.lower[problem.springs], problem.upper[problem.springs]
    if np.all((last == lower) | (last == upper)):
        raise CodecError(
            f"variant {prepared.variant.name!r} fits nothing: in all {len(curves)} splits every"
            " spring ends at a bound"
        )


def _padded(chosen: Sequence[IndexArray]) -> IndexArray:
    """Return choices of 1, 2, … poses as rows of one array, filled up with `NO_POSE`."""
    filled = np.full((len(chosen), len(chosen)), NO_POSE, dtype=np.intp)
    for row, poses in zip(filled, chosen, strict=True):
        row[: len(poses)] = poses
    return filled


def _train(
    entrant: Entrant, known: dict[frozenset[int], str], split: Split, most: int, seed: int
) -> _LearningCurve:
    """Return the errors that a variant reaches with 1 to ``most`` training poses of a split.

    Parameters
    ----------
    entrant : Entrant
        The variant.
    known : dict
        Springs by the training poses that carry them; springs chosen here are added.
    most : int
        Largest number of training poses.
    seed : int
        Searches draw from ``default_rng((seed, seed pose, number of poses))``, so that all
        variants with one technique draw alike.
    """
    taken = entrant.taken
    searched = taken
    if not technique(taken.variant.search).nested:
        # A technique that uses springs uses those that its whole pool supports.
        searched = _chosen_springs(entrant, known, taken.can_train(split))
    chosen = _choices(searched, split, most, seed)
    compliance = _fit(taken, chosen)
    springs, errors = [], []
    for sizes in _sizes_of_choices(most):
        each = _chosen_springs(entrant, known, chosen[sizes.start])
        fitted = compliance[sizes] if each is taken else _fit(each, chosen[sizes])
        springs += len(fitted) * [each.springs]
        errors.append(_verification_errors(each.problem, split, fitted))
    error = np.concatenate(errors)
    compliance = compliance[:, taken.problem.springs]
    return _LearningCurve(
        tuple(springs), tuple(chosen), compliance, error.mean(axis=1), error.max(axis=1)
    )


def _sizes_of_choices(most: int) -> list[slice]:
    """Return ranges of sizes in a learning curve; springs are chosen again at the start of each.

    The largest training set has a choice of its own, and below it every size that is 5\
    """
    starts = [most - 1]
    while starts[0] + 1 > MINIMUM_BLOCKS:
        starts.insert(0, max(MINIMUM_BLOCKS, int((starts[0] + 1) / _GROWTH)) - 1)
    starts = [0, *starts] if starts[0] else starts
    return [slice(*ends) for ends in pairwise([*starts, most])]


def _verification_errors(problem: Problem, split: Split, compliance: FloatArray) -> FloatArray:
    """Return absolute residuals at the verification poses, shape (n_train, reading, 4), in m."""
    verified = np.isin(problem.block, split.verification)
    O, d = problem.O[verified], problem.d[verified]  # noqa: E741 - paper
    # Verification always takes all load cases, whatever was trained with.
    residual = np.abs(compliance @ O.reshape(-1, O.shape[2]).T - d.ravel())
    residual = residual.reshape(len(compliance), -1, 3)
    norm = np.sqrt(np.square(residual).sum(axis=2, keepdims=True))
    return np.concatenate([residual, norm], axis=2)


def _fit(prepared: PreparedVariant, chosen: Sequence[IndexArray]) -> FloatArray:
    """Return the compliances of each choice of poses, shape (choice, column)."""
    if prepared.variant.options.loss == "linear":
        return prepared.triangles.fit(chosen)
    return np.array([_robust_fit(prepared, poses) for poses in chosen])


def _choices(prepared: PreparedVariant, split: Split, most: int, seed: int) -> list[IndexArray]:
    """Return the training poses for 1, 2, … of them (line 10)."""
    poses = prepared.can_train(split)
    wanted = technique(prepared.variant.search)

    def rng_of(count: int) -> Generator:
        return np.random.default_rng((seed, split.seed_pose, count))

    candidates = Candidates(prepared.contact[poses])
    if not wanted.nested:
        # For a technique that uses production, the training poses under all loads represent it: no
        # technique knows anything of the verification poses.
        everything = prepared.rows(poses, np.ones_like(prepared.trains))
        process = everything.reshape(-1, everything.shape[2])
        observation = prepared.rows(poses, prepared.trains)
        candidates = Candidates(candidates.contact, observation, process=process)
    return [poses[order] for order in growing_choices(wanted, candidates, most, rng_of)]


def _robust_fit(prepared: PreparedVariant, poses: IndexArray) -> FloatArray:
    used = prepared.trains & np.isin(prepared.problem.block, poses)
    return solve(prepared.problem.take(used), prepared.variant.options.loss).compliance
