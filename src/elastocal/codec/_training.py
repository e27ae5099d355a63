"""One variant on one split: choose, fit, verify (paper Algorithm 1, lines 8 to 18)."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.codec.data import CodecData
from elastocal.codec.splits import Campaign, Split, make_campaign
from elastocal.codec.variants import Variant, training_cases
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, layout
from elastocal.errors import CodecError
from elastocal.identification import PoseTriangles, Problem, build, solve
from elastocal.planning.search import Candidates, growing_choices, technique
from elastocal.robot import Robot

_SAME = 1e-9
"""Largest distance of a pose from where the codec has it, in m."""


@dataclass(frozen=True, eq=False)
class PreparedVariant:
    """A variant with all that it needs of the campaign, prepared once for all splits."""

    variant: Variant
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
        model: ElasticModel,
        campaign: Campaign,
        marker_offset: ArrayLike | None,
    ) -> "PreparedVariant":
        """Return a variant prepared for a campaign.

        Raises
        ------
        DatasetError
            If the dataset lacks a load case.
        """
        problem = build(model, campaign.readings, variant.options, marker_offset)
        cases = training_cases(variant.load_cases, campaign.load_cases)
        trains = np.isin(campaign.readings.load_case, cases)
        poses = np.arange(len(campaign))
        triangles = PoseTriangles.of(problem.take(trains), poses)
        return cls(variant, problem, trains, triangles, campaign.contact)

    def can_train(self, split: Split) -> IndexArray:
        """Return the training poses of a split that have a reading to train with, rising."""
        return split.training[np.isin(split.training, self.problem.block[self.trains])]

    def rows(self, poses: IndexArray, which: BoolArray) -> FloatArray:
        """Return observation rows of poses, zeros where readings are missing.

        Shape (pose, row, spring).
        """
        found = [self.problem.O[which & (self.problem.block == pose)] for pose in poses]
        rows = np.zeros((len(poses), max(map(len, found)), 3, self.problem.columns))
        for filled, blocks in zip(rows, found, strict=True):
            filled[: len(blocks)] = blocks
        return rows.reshape(len(poses), -1, self.problem.columns)


@dataclass(frozen=True, eq=False)
class LearningCurve:
    """Choices, fits and errors of a variant on a split, for 1, 2, … training poses."""

    chosen: tuple[IndexArray, ...]
    """Numbers of the training poses, in the order of choice."""
    compliance: FloatArray
    """Shape (n_train, spring), in rad/(N·m) or m/N."""
    error_mean: FloatArray
    """Mean absolute residual at the verification poses, shape (n_train, 4), in m; see `AXES`."""
    error_max: FloatArray
    """Largest absolute residual, likewise."""


def train(prepared: PreparedVariant, split: Split, most: int, seed: int) -> LearningCurve:
    """Return the errors that a variant reaches with 1 to ``most`` training poses of a split.

    Parameters
    ----------
    prepared : PreparedVariant
        The variant.
    split : Split
        The split.
    most : int
        Largest number of training poses.
    seed : int
        Searches draw from ``default_rng((seed, seed pose, number of poses))``, so that all
        variants with one technique draw alike.
    """
    chosen = _choices(prepared, split, most, seed)
    if prepared.variant.options.loss == "linear":
        compliance = prepared.triangles.fit(chosen)
    else:
        compliance = np.array([_robust_fit(prepared, poses) for poses in chosen])
    verified = np.isin(prepared.problem.block, split.verification)
    O, d = prepared.problem.O[verified], prepared.problem.d[verified]  # noqa: E741 - paper
    # Verification always takes all load cases, whatever was trained with.
    residual = np.abs(compliance @ O.reshape(-1, O.shape[2]).T - d.ravel())
    residual = residual.reshape(len(chosen), -1, 3)
    norm = np.sqrt(np.square(residual).sum(axis=2, keepdims=True))
    errors = np.concatenate([residual, norm], axis=2)
    return LearningCurve(tuple(chosen), compliance, errors.mean(axis=1), errors.max(axis=1))


def _choices(prepared: PreparedVariant, split: Split, most: int, seed: int) -> list[IndexArray]:
    """Return the training poses for 1, 2, … of them (line 10)."""
    poses = prepared.can_train(split)
    wanted = technique(prepared.variant.search)

    def rng_of(count: int) -> Generator:
        return np.random.default_rng((seed, split.seed_pose, count))

    candidates = Candidates(prepared.contact[poses])
    if not wanted.nested:
        # To a technique that looks at a production, the training poses under all loads stand
        # for it: nothing of the verification poses is known to any technique.
        everything = prepared.rows(poses, np.ones_like(prepared.trains))
        process = everything.reshape(-1, everything.shape[2])
        observation = prepared.rows(poses, prepared.trains)
        candidates = Candidates(candidates.contact, observation, process=process)
    return [poses[order] for order in growing_choices(wanted, candidates, most, rng_of)]


def _robust_fit(prepared: PreparedVariant, poses: IndexArray) -> FloatArray:
    used = prepared.trains & np.isin(prepared.problem.block, poses)
    return solve(prepared.problem.take(used), prepared.variant.options.loss).compliance


def prepared_variants(
    robot: Robot, readings: Readings, data: CodecData, marker_offset: ArrayLike | None = None
) -> tuple[PreparedVariant, ...]:
    """Return the variants of a finished codec, prepared again from its readings.

    Parameters
    ----------
    robot : Robot
        The robot.
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
        If the data lack a load case, or joints are not this robot's.
    """
    models = {
        each.springs: ElasticModel(robot, layout(robot, each.springs)) for each in data.variants
    }
    for each, labels in zip(data.variants, data.springs, strict=True):
        found = models[each.springs].parameter_names
        if found != labels.names:
            raise CodecError(
                f"variant {each.name!r} was made with {len(labels.names)} springs;"
                f" {each.springs!r} now has {len(found)}, or others"
            )
    campaign = make_campaign(list(models.values()), readings, data.options, marker_offset)
    contact = campaign.contact
    if contact.shape != data.contact.shape or not np.all(np.abs(contact - data.contact) <= _SAME):
        raise CodecError(
            f"the readings are not those of the codec: they have {len(contact)} poses, the codec"
            f" {len(data.contact)}, or poses lie elsewhere"
        )
    return tuple(
        PreparedVariant.of(each, models[each.springs], campaign, marker_offset)
        for each in data.variants
    )
