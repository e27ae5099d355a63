"""Variants prepared for a campaign: their rows and the springs that the readings support.

Where a variant leaves its springs to the readings (``auto``), the ladder of `calibrate` is fitted
once to all of them, which gives the springs that the file supports, and again to the training poses
of each split, at some sizes of the training set. So no verification pose has influenced the choice
whose error it measures. Rows are those of all readings at a pose, so that the friction memory is
the same in any split.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.codec.data import CodecData
from elastocal.codec.splits import Campaign, CodecOptions, Split, checked_campaign, drawn_poses
from elastocal.codec.variants import ALL_LOADS, Variant, training_cases
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.errors import CodecError, IdentificationError
from elastocal.identification import (
    AUTO,
    MINIMUM_BLOCKS,
    Choice,
    FitOptions,
    PoseTriangles,
    Problem,
    allowed_rungs,
    build,
    choose_model,
    low_loads,
    rung_of,
    take_best,
    try_rung,
    usable_for_choice,
)
from elastocal.results import brief_repr
from elastocal.robot import Robot

_SAME = 1e-9
"""Largest distance of a pose from where the codec has it, in m."""


@brief_repr
@dataclass(frozen=True, eq=False)
class PreparedVariant:
    """A variant with all that it needs of the campaign, prepared once for all splits."""

    variant: Variant
    springs: str
    """Name of its springs."""
    model: ElasticModel
    problem: Problem
    """All readings; blocks are the numbers of the physical poses."""
    trains: BoolArray
    """Whether the variant may train with each reading, shape (reading,)."""
    triangles: PoseTriangles
    """Triangles of the training readings of each pose."""
    contact: FloatArray
    """Tcp positions, shape (pose, 3), in m."""

    @classmethod
    def of(
        cls,
        variant: Variant,
        springs: str,
        model: ElasticModel,
        campaign: Campaign,
        options: CodecOptions,
        marker_offset: ArrayLike | None,
    ) -> "PreparedVariant":
        """Return a variant prepared for a campaign.

        Raises
        ------
        DatasetError
            If the dataset lacks a load case.
        """
        fit = replace(variant.options, contact=options.contact)
        problem = build(model, campaign.readings, fit, marker_offset)
        cases = training_cases(variant.load_cases, campaign.load_cases)
        trains = np.isin(campaign.readings.load_case, cases)
        poses = np.arange(len(campaign))
        triangles = PoseTriangles.of(problem.take(trains), poses)
        return cls(variant, springs, model, problem, trains, triangles, campaign.contact)

    def can_train(self, split: Split) -> IndexArray:
        """Return the training poses of a split that have a reading to train with, rising."""
        return split.training[np.isin(split.training, self.problem.block[self.trains])]

    def rows(self, poses: IndexArray, which: BoolArray) -> FloatArray:
        """Return observation rows of the springs at poses, zeros where readings are missing.

        Shape (pose, row, spring).
        """
        of_springs = self.problem.O[:, :, self.problem.springs]
        found = [of_springs[which & (self.problem.block == pose)] for pose in poses]
        rows = np.zeros((len(poses), max(map(len, found)), *of_springs.shape[1:]))
        for filled, blocks in zip(rows, found, strict=True):
            filled[: len(blocks)] = blocks
        return rows.reshape(len(poses), -1, of_springs.shape[2])


@dataclass(frozen=True, eq=False)
class Entrant:
    """A variant with all springs that a split may choose from."""

    taken: PreparedVariant
    """Variant with the springs that the file supports."""
    allowed: tuple[PreparedVariant, ...]
    """Variants with each of the springs to choose from, the simplest first; a single one if the
    springs are given."""
    low: BoolArray
    """Whether each reading is of low load, shape (reading,)."""

    def chosen(self, poses: IndexArray) -> str:
        """Return the name of the springs that training poses carry.

        Those that `calibrate` would take on them; it refuses fewer than `MINIMUM_BLOCKS` poses,
        which carry no choice: the simplest.
        """
        if len(self.allowed) == 1 or len(poses) < MINIMUM_BLOCKS:
            return self.allowed[0].springs
        rows = self.taken.trains & np.isin(self.taken.problem.block, poses)
        tried = [
            try_rung(each.springs, each.model, each.problem.take(rows), self.low[rows])
            for each in self.allowed
        ]
        return take_best(tried, [each.name for each in tried]).taken

    def with_springs(self, name: str) -> PreparedVariant:
        """Return the variant with the springs of this name."""
        return next(each for each in self.allowed if each.springs == name)


def climbed_ladder(
    robot: Robot,
    readings: Readings,
    variants: Sequence[Variant],
    options: CodecOptions,
    marker_offset: ArrayLike | None,
) -> Choice:
    """Return the ladder of `calibrate` on all readings, with what else is compared beside it."""
    for each in variants:
        # Refuses an unknown word before any fit.
        _ = each.springs == AUTO or rung_of(robot, each.springs)
    fit = _fit_options(options)
    beside = [each.springs for each in variants]
    return choose_model(robot, readings, AUTO, fit, marker_offset, beside)


def _fit_options(options: CodecOptions) -> FitOptions:
    """Return the options of fits to all readings."""
    return FitOptions(set_blunders_aside=options.set_blunders_aside, contact=options.contact)


def taken_springs(ladder: Choice, springs: str) -> str:
    """Return the name of the springs that `calibrate` takes for a user's word.

    Raises
    ------
    IdentificationError
        If the readings carry none of them.
    """
    allowed = allowed_rungs(springs)
    if not {each.name for each in ladder.ladder}.intersection(allowed):
        refused = (each for each in ladder.refused if each.values["springs"] in allowed)
        if (why := next(refused, None)) is not None:
            raise IdentificationError(why)
    return take_best(ladder.ladder, allowed).taken


def make_entrant(
    variant: Variant,
    taken: str,
    models: Mapping[str, ElasticModel],
    campaign: Campaign,
    options: CodecOptions,
    marker_offset: ArrayLike | None,
) -> Entrant:
    """Return a variant prepared with each of the springs that it may have.

    Parameters
    ----------
    variant, campaign, options, marker_offset
        As for `PreparedVariant.of`.
    taken : str
        From `taken_springs`.
    models : mapping of str to ElasticModel
        By rung of the ladder.
    """
    allowed = [name for name in allowed_rungs(variant.springs) if name in models]
    prepared = {
        name: PreparedVariant.of(variant, name, models[name], campaign, options, marker_offset)
        for name in allowed
    }
    return Entrant(prepared[taken], tuple(prepared.values()), low_loads(campaign.readings))


def left_out_errors(ladder: Choice, variants: Sequence[Variant]) -> FloatArray:
    """Return the errors at left-out poses by which `calibrate` judges each variant.

    Shape (variant, pose), in m, of the poses that it counts; NaN for variants that train or fit
    otherwise than `calibrate`, or whose springs have been chosen by these very errors.
    """
    first = ladder.ladder[0]
    counted = np.ones(len(first.score), dtype=bool) if first.counted is None else first.counted
    scores = {each.name: each.score[counted] for each in ladder.ladder}
    unknown = np.full(int(counted.sum()), np.nan)
    found = []
    for each in variants:
        choice = [name for name in allowed_rungs(each.springs) if name in scores]
        usual = each.load_cases == ALL_LOADS and each.solver == Variant.solver
        found.append(scores[choice[0]] if usual and len(choice) == 1 else unknown)
    return np.array(found)


def prepared_variants(
    robot: Robot, readings: Readings, data: CodecData, marker_offset: ArrayLike | None = None
) -> tuple[PreparedVariant, ...]:
    """Return the variants of a finished codec, prepared again from its readings.

    Parameters
    ----------
    readings : Readings
        Those that the codec was made from.
    data : CodecData
        The codec.
    marker_offset : array_like, shape (3,), optional
        Metrology marker in the tcp frame, in m.

    Raises
    ------
    CodecError
        If the readings have other poses than the codec, or a layout has other springs.
    DatasetError
        If the data lack a load case.
    """
    readings = drawn_poses(readings, data.options)
    kept = usable_for_choice(robot, readings, _fit_options(data.options), marker_offset)
    models = {
        name: ElasticModel(robot, rung_of(robot, name).springs(robot, kept))
        for name in dict.fromkeys(data.layouts)
    }
    for each, name, labels in zip(data.variants, data.layouts, data.springs, strict=True):
        found = models[name].parameter_names
        if found != labels.names:
            raise CodecError(
                f"variant {each.name!r} was made with {len(labels.names)} springs;"
                f" {name!r} now has {len(found)}, or others"
            )
    campaign = checked_campaign(list(models.values()), readings, data.options, marker_offset)
    contact = campaign.contact
    if contact.shape != data.contact.shape or not np.all(np.abs(contact - data.contact) <= _SAME):
        raise CodecError(
            f"the readings are not those of the codec: they have {len(contact)} poses, the codec"
            f" {len(data.contact)}, or poses lie elsewhere"
        )
    return tuple(
        PreparedVariant.of(each, name, models[name], campaign, data.options, marker_offset)
        for each, name in zip(data.variants, data.layouts, strict=True)
    )
