"""Measured poses, and which of them verify and which may train (paper Algorithm 1, lines 2 to 7).

A configuration that was measured twice is one pose, and readings that cannot be measurements are
set aside first, for all variants alike.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.errors import CodecError
from elastocal.findings import Finding, Kind
from elastocal.identification import (
    MINIMUM_BLOCKS,
    Contact,
    FitOptions,
    build,
    find_mistakes,
    pose_blocks,
    poses_in_company,
    same_configuration,
    screen,
)
from elastocal.options import Option
from elastocal.planning.search import Candidates, Cover
from elastocal.results import brief_repr
from elastocal.robot import Robot

_RATIO = 70.0 / 30.0
"""Training to verification poses, the paper's ``r``."""


@dataclass(frozen=True, kw_only=True)
class CodecOptions:
    """Choices about the splits, and about the readings that are split."""

    splits: Annotated[int | None, Option(most=100_000)] = None
    """Number ``N_cv`` of verification sets; default: as many as poses."""
    ratio: Annotated[float, Option(metavar="A/B", read="ratio", default="70/30")] = _RATIO
    """Training to verification poses, ``r``."""
    seed: Annotated[int, Option(least=0)] = 0
    """Seed of the techniques that draw, and of the intervals."""
    keep_blunders: bool = False
    """Use also readings that cannot be measurements of this robot."""
    trust_conventions: bool = False
    """Use also data that fit far better with a sign or frame read otherwise."""
    poses: Annotated[int, Option(most=1_000_000)] = 100
    """Most poses; of a larger dataset as many are drawn by the seed."""
    contact: Contact | None = None
    """What is known of the contact that held the tool where no tracker measured."""

    @property
    def set_blunders_aside(self) -> bool:
        """Whether readings that cannot be measurements of this robot are left out."""
        return not self.keep_blunders

    def __post_init__(self) -> None:
        # Work and memory grow with the cube of their number; too few say nothing.
        if not self.poses >= MINIMUM_BLOCKS:
            raise CodecError(f"{self.poses} poses: at least {MINIMUM_BLOCKS} are needed")
        if not 0.0 < self.ratio < np.inf:
            raise CodecError(
                f"ratio {self.ratio:g} of training to verification poses: must be above 0"
            )
        if not self.seed >= 0:
            raise CodecError(f"seed {self.seed}: must be 0 or above")


@brief_repr
@dataclass(frozen=True, eq=False)
class Campaign:
    """Readings grouped by physical pose.

    A configuration that was measured twice is one pose, so that it is never verified by itself.
    """

    readings: Readings
    """Readings to train and to verify with."""
    pose: IndexArray
    """Number of the physical pose of each reading, shape (reading,), from 0 without gaps."""
    contact: FloatArray
    """Tcp positions in base, shape (pose, 3), in m: the mean over the pose's readings of the
    forward kinematics of the recorded joints."""
    company: BoolArray
    """Poses that may verify, shape (pose,); see `identification.poses_in_company`."""
    labels: tuple[tuple[int, ...], ...]
    """Labels of each pose in the dataset."""
    findings: tuple[Finding, ...]
    """Notes on the data for the user."""

    def __len__(self) -> int:
        """Return the number of physical poses."""
        return len(self.contact)

    @property
    def load_cases(self) -> tuple[str, ...]:
        """Load cases that have readings, in the order of the dataset."""
        return tuple(dict.fromkeys(self.readings.load_case.tolist()))


def drawn_poses(readings: Readings, options: CodecOptions) -> Readings:
    """Return the readings of the poses that a codec is made on, the same for the same seed.

    They are drawn, not spread, so that errors at them are those at the poses of the dataset.

    Parameters
    ----------
    readings : Readings
        All measurements.
    options : CodecOptions
        How many poses at most, and the seed.
    """
    labels = np.unique(readings.pose)
    if len(labels) <= options.poses:
        return readings
    rng = np.random.default_rng((options.seed, len(labels)))
    drawn = rng.choice(labels, options.poses, replace=False)
    return readings.take(np.isin(readings.pose, drawn))


SET_ASIDE = Kind(
    "codec.set-aside",
    "pose {pose}, load case {load_case} is set aside: it cannot be a measurement of this robot",
    shown={"load_case": repr},
)
SAME_CONFIGURATION = Kind(
    "codec.same-configuration",
    "poses {poses} are one configuration: kept on one side of each split",
)
HELD_BY_CONTACT = Kind(
    "codec.held-by-contact",
    "no tracker measured at {count} poses: there errors are those of predicting what the controller"
    " travels, the spread of the contact from place to place in them",
)
FAR_FROM_OTHERS = Kind(
    "codec.far-from-others",
    "pose {pose} is far from all others: it trains, and verifies nothing, as it is left"
    " out of the ladder",
)


def make_campaign(
    models: Sequence[ElasticModel],
    readings: Readings,
    options: CodecOptions,
    marker_offset: ArrayLike | None = None,
) -> Campaign:
    """Return the poses of a dataset, checked as `calibrate` checks them.

    A reading is set aside if it is a blunder for every model of the comparison, so that all
    variants are trained and verified on the same readings.

    Parameters
    ----------
    models : sequence of ElasticModel
        Models of the comparison, of one robot; the first must explain signs and frames.
    readings : Readings
        Measurements, joints in the robot's order.
    options : CodecOptions
        Whether blunders are set aside, and conventions trusted.
    marker_offset : array_like, shape (3,), optional
        Metrology marker in the tcp frame, in m.

    Raises
    ------
    DatasetError
        If joints are outside the robot's limits or elsewhere than the recorded positions.
    ConventionError
        If the data fit only with a sign or frame read otherwise.
    IdentificationError
        If there are fewer than three distinct poses.
    """
    fit = FitOptions(contact=options.contact, trust_conventions=options.trust_conventions)
    findings = list(find_mistakes(models[0], readings, fit, marker_offset))
    held = np.unique(readings.pose[readings.by_contact])
    if len(held):
        findings.append(HELD_BY_CONTACT(count=len(held)))
    campaign = checked_campaign(models, readings, options, marker_offset)
    return replace(campaign, findings=(*findings, *campaign.findings))


def checked_campaign(
    models: Sequence[ElasticModel],
    readings: Readings,
    options: CodecOptions,
    marker_offset: ArrayLike | None = None,
) -> Campaign:
    """Return the poses of a dataset whose joints, signs and frames `make_campaign` has checked.

    Parameters
    ----------
    models, readings, options, marker_offset
        As for `make_campaign`.
    """
    if not options.set_blunders_aside:
        return _group_by_pose(models[0].robot, readings, [])
    blunder = _blunders(models, readings, FitOptions(contact=options.contact), marker_offset)
    findings = [
        SET_ASIDE(pose=int(readings.pose[row]), load_case=str(readings.load_case[row]))
        for row in np.flatnonzero(blunder)
    ]
    return _group_by_pose(models[0].robot, readings.set_aside(blunder), findings)


def _group_by_pose(robot: Robot, readings: Readings, findings: list[Finding]) -> Campaign:
    """Return readings by physical pose."""
    pose = pose_blocks(readings)
    repeated = [SAME_CONFIGURATION(poses=group) for group in same_configuration(readings, pose)]
    position = robot.forward(readings.joint_position)[:, :3, 3]
    counts = np.bincount(pose)
    contact = np.stack([np.bincount(pose, axis) / counts for axis in position.T], axis=1)
    labels = tuple(
        tuple(np.unique(readings.pose[pose == number]).tolist()) for number in range(len(counts))
    )
    company = poses_in_company(robot, readings.joint_position, pose)
    lone = [FAR_FROM_OTHERS(pose=labels[number]) for number in np.flatnonzero(~company).tolist()]
    return Campaign(readings, pose, contact, company, labels, (*findings, *repeated, *lone))


def _blunders(
    models: Sequence[ElasticModel],
    readings: Readings,
    fit: FitOptions,
    marker_offset: ArrayLike | None,
) -> BoolArray:
    """Return which readings every model takes for blunders, shape (reading,)."""
    found = [screen(build(model, readings, fit, marker_offset)).blunder for model in models]
    return np.asarray(np.all(found, axis=0))


@brief_repr
@dataclass(frozen=True, eq=False)
class Split:
    """One verification set and what is left to train with."""

    seed_pose: int
    """Number of the pose that the set was grown from."""
    verification: IndexArray
    """Numbers of the verification poses in the order of choice, shape (N_v,)."""
    training: IndexArray
    """Numbers of the others, rising, shape (N_c,)."""


def split_sizes(poses: int, ratio: float = _RATIO) -> tuple[int, int]:
    """Return the numbers of training and of verification poses, ``N_c`` and ``N_v``.

    ``N_c = round(N r / (r + 1))``, a half to the even number; ``N_v = N - N_c``.

    >>> split_sizes(31)
    (22, 9)

    Raises
    ------
    CodecError
        If a side of the split has no pose.
    """
    training = round(poses * ratio / (ratio + 1.0))
    if not 1 <= training < poses:
        raise CodecError(
            f"{poses} poses split {ratio:.3g} to 1 give {training} training and"
            f" {poses - training} verification poses: at least 1 of each is needed"
        )
    return training, poses - training


def make_splits(
    contact: FloatArray, count: int | None, verification: int, company: BoolArray | None = None
) -> tuple[Split, ...]:
    """Return splits whose verification sets are COVER sets grown from different poses.

    Parameters
    ----------
    contact : ndarray, shape (pose, 3)
        Contact points, in m.
    count : int, optional
        Number ``N_cv`` of splits, grown from the first ``N_cv`` poses that may verify; default: as
        many as there are of these.
    verification : int
        Poses in each verification set, ``N_v``; fewer where so many may not verify.
    company : ndarray of bool, shape (pose,), optional
        Which poses may verify; default: all. Errors at the others, far from any that trains, would
        be those of an extrapolation.

    Raises
    ------
    CodecError
        If there are fewer poses than splits, or less than one split is wanted.
    """
    able = np.arange(len(contact)) if company is None else np.flatnonzero(company)
    count = len(able) if count is None else count
    if not 1 <= count <= len(able):
        raise CodecError(
            f"{count} splits wanted, each grown from a pose of its own: must be from 1 to the"
            f" {len(able)} poses of the dataset"
        )
    pool, size = Candidates(contact[able]), min(verification, len(able) - 1)
    chosen = [able[Cover(first=first).search(pool, size).order] for first in range(count)]
    every = np.arange(len(contact))
    return tuple(Split(int(each[0]), each, np.setdiff1d(every, each)) for each in chosen)
