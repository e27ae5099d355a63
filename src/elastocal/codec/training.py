"""One variant on one split: choose, fit, verify (paper Algorithm 1, lines 8 to 18)."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.codec.campaign import Campaign
from elastocal.codec.splits import Split
from elastocal.codec.variants import Variant, training_cases
from elastocal.elastic import ElasticModel
from elastocal.identification import PoseTriangles, Problem, build, solve
from elastocal.planning.search import Candidates, growing_choices, technique

AXES = ("x", "y", "z", "norm")
"""What errors are of: the components in base, and the length of the vector."""


@dataclass(frozen=True, eq=False)
class Trainee:
    """What a variant needs of the campaign, prepared once for all splits."""

    variant: Variant
    problem: Problem
    """All readings; blocks are the numbers of the physical poses."""
    trains: BoolArray
    """Whether the variant may train with each reading, shape (reading,)."""
    triangles: PoseTriangles
    """Of the training readings of each pose."""
    contact: FloatArray
    """Tcp positions, shape (pose, 3), in m."""

    @classmethod
    def of(
        cls,
        variant: Variant,
        model: ElasticModel,
        campaign: Campaign,
        marker_offset: ArrayLike | None,
    ) -> "Trainee":
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
class Outcome:
    """What a variant reached on a split, for 1, 2, … training poses."""

    chosen: tuple[IndexArray, ...]
    """Numbers of the training poses, in the order of choice."""
    compliance: FloatArray
    """Shape (n_train, spring), in rad/(N·m) or m/N."""
    error_mean: FloatArray
    """Mean absolute residual at the verification poses, shape (n_train, 4), in m; see `AXES`."""
    error_max: FloatArray
    """Largest absolute residual, likewise."""


def train(trainee: Trainee, split: Split, most: int, seed: int) -> Outcome:
    """Return what a variant reaches with 1 to ``most`` training poses of a split.

    Parameters
    ----------
    trainee : Trainee
        The variant.
    split : Split
        The split.
    most : int
        Largest number of training poses.
    seed : int
        Searches draw from ``default_rng((seed, seed pose, number of poses))``, so that all
        variants with one technique draw alike.
    """
    chosen = _choices(trainee, split, most, seed)
    if trainee.variant.options.loss == "linear":
        compliance = trainee.triangles.fit(chosen)
    else:
        compliance = np.array([_robust_fit(trainee, poses) for poses in chosen])
    verified = np.isin(trainee.problem.block, split.verification)
    O, d = trainee.problem.O[verified], trainee.problem.d[verified]  # noqa: E741 - paper
    # Verification always takes all load cases, whatever was trained with.
    residual = np.abs(compliance @ O.reshape(-1, O.shape[2]).T - d.ravel())
    residual = residual.reshape(len(chosen), -1, 3)
    norm = np.sqrt(np.square(residual).sum(axis=2, keepdims=True))
    errors = np.concatenate([residual, norm], axis=2)
    return Outcome(tuple(chosen), compliance, errors.mean(axis=1), errors.max(axis=1))


def _choices(trainee: Trainee, split: Split, most: int, seed: int) -> list[IndexArray]:
    """Return the training poses for 1, 2, … of them (line 10)."""
    poses = trainee.can_train(split)
    wanted = technique(trainee.variant.search)

    def rng_of(count: int) -> Generator:
        return np.random.default_rng((seed, split.seed_pose, count))

    candidates = Candidates(trainee.contact[poses])
    if not wanted.nested:
        # To a technique that looks at a production, the training poses under all loads stand
        # for it: nothing of the verification poses is known to any technique.
        everything = trainee.rows(poses, np.ones_like(trainee.trains))
        process = everything.reshape(-1, everything.shape[2])
        observation = trainee.rows(poses, trainee.trains)
        candidates = Candidates(candidates.contact, observation, process=process)
    return [poses[order] for order in growing_choices(wanted, candidates, most, rng_of)]


def _robust_fit(trainee: Trainee, poses: IndexArray) -> FloatArray:
    used = trainee.trains & np.isin(trainee.problem.block, poses)
    return solve(trainee.problem.take(used), trainee.variant.options.loss).compliance
