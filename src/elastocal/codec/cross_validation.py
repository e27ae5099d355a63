"""Repeated cross-validation over growing training sets (paper 3.2, Algorithm 1)."""

from collections.abc import Sequence
from functools import partial
from importlib.metadata import version

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import IndexArray
from elastocal.codec._training import LearningCurve, PreparedVariant, train
from elastocal.codec.data import NO_POSE, CodecData, SpringLabels
from elastocal.codec.splits import CodecOptions, Split, make_campaign, make_splits, split_sizes
from elastocal.codec.variants import Variant, check_different
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, layout
from elastocal.errors import CodecError, IdentificationError
from elastocal.parallel import map_in_processes, one_blas_thread, process_count
from elastocal.planning.search import technique
from elastocal.progress import Progress, silent
from elastocal.robot import Robot

_STAGE = "splits"
_WORTH_PROCESSES = 2000
"""Fits behind a search of their own, or by a robust loss, from which on all cores are used."""

_PACKAGES = ("elastocal", "numpy", "scipy")


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
    robot : Robot
        The robot.
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
        Processes; default: one, but all cores for long work, where variants search anew for
        every size or fit by a robust loss. The numbers do not depend on it.
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
    layouts = {each.springs: layout(robot, each.springs) for each in variants}
    models = {name: ElasticModel(robot, springs) for name, springs in layouts.items()}
    campaign = make_campaign(list(models.values()), readings, options, marker_offset)
    check_different(variants, campaign.load_cases)
    training, verification = split_sizes(len(campaign), options.ratio)
    splits = make_splits(campaign.contact, options.splits, verification)
    prepared = [
        PreparedVariant.of(each, models[each.springs], campaign, marker_offset) for each in variants
    ]
    most = min(_largest_training_set(each, splits) for each in prepared)
    findings = list(campaign.findings)
    if most < training:
        findings.append(
            f"training sets end at {most} of {training} poses: the others have no reading of the"
            " load cases that a variant trains with"
        )
    processes = _processes(jobs, variants, most, len(splits))
    curves = _run_splits(prepared, splits, most, options.seed, processes, progress)
    for each, found in zip(prepared, curves, strict=True):
        _require_a_fit(each, found)
    return CodecData(
        variants=tuple(variants),
        springs=tuple(SpringLabels.of(layouts[each.springs]) for each in variants),
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
        versions={name: version(name) for name in _PACKAGES},
    )


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


def _processes(jobs: int | None, variants: Sequence[Variant], most: int, splits: int) -> int:
    """Return the number of processes; starting them takes as long as a thousand slow fits."""
    slow = sum(not technique(v.search).nested or v.options.loss != "linear" for v in variants)
    return process_count(jobs or None, splits, worthwhile=slow * most * splits > _WORTH_PROCESSES)


def _run_splits(
    prepared: Sequence[PreparedVariant],
    splits: Sequence[Split],
    most: int,
    seed: int,
    processes: int,
    progress: Progress,
) -> list[list[LearningCurve]]:
    """Return the learning curves by variant and split."""
    run = partial(_run_split, prepared, most, seed)
    found = []
    progress(_STAGE, 0, len(splits))
    for curves in map_in_processes(run, splits, processes):
        found.append(curves)
        progress(_STAGE, len(found), len(splits))
    return [list(column) for column in zip(*found, strict=True)]


def _run_split(
    prepared: Sequence[PreparedVariant], most: int, seed: int, split: Split
) -> list[LearningCurve]:
    """Return the learning curve of each variant on one split."""
    curves = []
    for each in prepared:
        try:
            curves.append(train(each, split, most, seed))
        except IdentificationError as error:
            raise IdentificationError(
                f"variant {each.variant.name!r}, split grown from pose {split.seed_pose}: {error}"
            ) from error
    return curves


def _require_a_fit(prepared: PreparedVariant, curves: Sequence[LearningCurve]) -> None:
    """Refuse a variant whose largest training sets leave every spring at a bound."""
    last = np.array([curve.compliance[-1] for curve in curves])
    problem = prepared.problem
    if np.all((last == problem.lower) | (last == problem.upper)):
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
