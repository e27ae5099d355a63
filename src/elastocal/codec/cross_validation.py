"""Repeated cross-validation over growing training sets (paper 3.2, Algorithm 1)."""

import os
from collections.abc import Callable, Sequence
from importlib.metadata import version

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import ArrayLike

from elastocal.arrays import IndexArray
from elastocal.codec.campaign import make_campaign
from elastocal.codec.data import NONE, CodecData, SpringLabels
from elastocal.codec.options import CodecOptions
from elastocal.codec.splits import Split, make_splits, split_sizes
from elastocal.codec.training import Outcome, Trainee, train
from elastocal.codec.variants import Variant, check_different
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, layout
from elastocal.errors import CodecError, IdentificationError
from elastocal.planning.search import technique
from elastocal.robot import Robot

Report = Callable[[str, int, int], None]
"""Told a stage, how much of it is done and how much there is."""
STAGE = "splits"

_WORTH_PROCESSES = 2000
"""Fits behind a search of their own, or by a robust loss, from which on all cores are used."""

_PACKAGES = ("elastocal", "numpy", "scipy")


def cross_validate(
    robot: Robot,
    readings: Readings,
    variants: Sequence[Variant] = (Variant(),),
    options: CodecOptions | None = None,
    *,
    marker_offset: ArrayLike | None = None,
    provenance: str = "",
    jobs: int | None = None,
    report: Report | None = None,
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
    report : callable, optional
        Told of each split that is done.

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
    trainees = [
        Trainee.of(each, models[each.springs], campaign, marker_offset) for each in variants
    ]
    most = min(_most(trainee, splits) for trainee in trainees)
    findings = list(campaign.findings)
    if most < training:
        findings.append(
            f"training sets end at {most} of {training} poses: the others have no reading of the"
            " load cases that a variant trains with"
        )
    processes = _processes(jobs, variants, most * len(splits))
    outcomes = _run(trainees, splits, most, options.seed, processes, report or _silent)
    for trainee, found in zip(trainees, outcomes, strict=True):
        _refuse_nothing_fitted(trainee, found)
    return CodecData(
        variants=tuple(variants),
        springs=tuple(SpringLabels.of(layouts[each.springs]) for each in variants),
        pose_labels=campaign.labels,
        contact=campaign.contact,
        seed_pose=np.array([split.seed_pose for split in splits]),
        verification=np.array([split.verification for split in splits]),
        chosen=np.array([[_padded(each.chosen) for each in found] for found in outcomes]),
        compliance=tuple(np.array([each.compliance for each in found]) for found in outcomes),
        error_mean=np.array([[each.error_mean for each in found] for found in outcomes]),
        error_max=np.array([[each.error_max for each in found] for found in outcomes]),
        load_cases=campaign.load_cases,
        options=options,
        robot=robot.name,
        provenance=provenance,
        findings=tuple(findings),
        versions={name: version(name) for name in _PACKAGES},
    )


def _most(trainee: Trainee, splits: Sequence[Split]) -> int:
    """Return the largest training set that every split can give a variant."""
    most = min(len(trainee.can_train(split)) for split in splits)
    if most < 1:
        raise CodecError(
            f"variant {trainee.variant.name!r} fits nothing: a split leaves it no training pose"
            f" with a reading of load cases {trainee.variant.load_cases!r}"
        )
    return most


def _processes(jobs: int | None, variants: Sequence[Variant], fits: int) -> int:
    """Return the number of processes; starting them takes as long as a thousand slow fits."""
    slow = sum(not technique(v.search).nested or v.options.loss != "linear" for v in variants)
    return jobs or ((os.cpu_count() or 1) if slow * fits > _WORTH_PROCESSES else 1)


def _run(
    trainees: Sequence[Trainee],
    splits: Sequence[Split],
    most: int,
    seed: int,
    processes: int,
    report: Report,
) -> list[list[Outcome]]:
    """Return the outcomes by variant and split."""
    parallel = Parallel(n_jobs=min(processes, len(splits)), return_as="generator")
    found = []
    report(STAGE, 0, len(splits))
    for outcome in parallel(delayed(_run_split)(trainees, split, most, seed) for split in splits):
        found.append(outcome)
        report(STAGE, len(found), len(splits))
    return [list(column) for column in zip(*found, strict=True)]


def _run_split(trainees: Sequence[Trainee], split: Split, most: int, seed: int) -> list[Outcome]:
    return [_run_one(trainee, split, most, seed) for trainee in trainees]


def _run_one(trainee: Trainee, split: Split, most: int, seed: int) -> Outcome:
    try:
        return train(trainee, split, most, seed)
    except IdentificationError as error:
        raise IdentificationError(
            f"variant {trainee.variant.name!r}, split grown from pose {split.seed_pose}: {error}"
        ) from error


def _refuse_nothing_fitted(trainee: Trainee, outcomes: Sequence[Outcome]) -> None:
    """Refuse a variant whose largest training sets leave every spring at a bound."""
    last = np.array([outcome.compliance[-1] for outcome in outcomes])
    problem = trainee.problem
    if np.all((last == problem.lower) | (last == problem.upper)):
        raise CodecError(
            f"variant {trainee.variant.name!r} fits nothing: in all {len(outcomes)} splits every"
            " spring ends at a bound"
        )


def _padded(chosen: Sequence[IndexArray]) -> IndexArray:
    """Return choices of 1, 2, … poses as rows of one array, filled up with `NONE`."""
    filled = np.full((len(chosen), len(chosen)), NONE, dtype=np.intp)
    for row, poses in zip(filled, chosen, strict=True):
        row[: len(poses)] = poses
    return filled


def _silent(stage: str, done: int, total: int) -> None:
    """Report to nobody."""
