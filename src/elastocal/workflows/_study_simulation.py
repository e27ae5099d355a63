"""Simulates the samples of a study: what its processes and the workers of a cluster import.

A module of its own, since the command's imports draw figures and make pools; without them a process
is ready in about half the time. It has the simulator's truth on one side, the estimator on the
other.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import CONDITIONING, LIGHT_CONTACT
from elastocal.codec import ALL_LOADS, study as studies, training_cases
from elastocal.codec.study import Condition, ConditionResult, Sample, SampleResult
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.identification import FitOptions, choose_model, with_knowledge
from elastocal.robot import Robot
from elastocal.sim.workcell import (
    CampaignErrors,
    CampaignSimulator,
    ContactPoses,
    ErrorDraws,
    ErrorScales,
)


@dataclass(frozen=True, eq=False)
class StudySimulation:
    """Simulates samples of one study; sent to processes as it is."""

    conditions: tuple[Condition, ...]
    chosen: tuple[studies.PoseChoice, ...]
    """Calibration poses of each condition."""
    robot: Robot
    models: dict[str, ElasticModel]
    """Models by spring layout; a choice by readings is made again in each sample."""
    truth: CampaignSimulator
    errors: CampaignErrors
    pool: studies.StudyPool
    load_cases: tuple[str, ...]
    """The full cases: what a condition may name, and what all are verified under."""
    force_tcp: FloatArray
    """Their force in the tcp frame, shape (load_case, 3), in N."""
    presses: dict[str, FloatArray]
    """All that is pressed at a pose, in order in time; see `CellFile.presses`."""
    check: str | None
    """The load case that is kept out of every fit."""
    marker: FloatArray
    """In the tcp frame, shape (3,), in m."""

    def __call__(self, sample: Sample) -> SampleResult:
        """Return the sample's arm, calibrated under every condition."""
        rng = sample.generator(studies.Purpose.TRUTH)
        stiffness, balancer = rng.standard_normal(self.truth.springs), rng.standard_normal()
        draws = ErrorDraws.of(
            len(self.pool), len(self.measured), sample.generator(studies.Purpose.ERRORS)
        )
        found: dict[int, ConditionResult] = {}
        for spread in dict.fromkeys(each.truth for each in self.conditions):
            arm = self.truth.stiffened(np.exp(spread * stiffness), float(np.exp(spread * balancer)))
            verification = self._verification(arm, 2 * sample.number + 1)
            for cases in dict.fromkeys(each.load_cases for each in self.conditions):
                numbers = [
                    number
                    for number, each in enumerate(self.conditions)
                    if each.truth == spread and each.load_cases == cases
                ]
                found |= self._calibrated(sample, arm, draws, numbers, verification)
        return SampleResult(sample.number, tuple(found[i] for i in range(len(self.conditions))))

    @property
    def measured(self) -> tuple[str, ...]:
        """Presses that become readings, in order in time: all but that of the reference."""
        return tuple(name for name in self.presses if name != LIGHT_CONTACT)

    def places(self, poses: IndexArray) -> ContactPoses:
        """Return some poses of the pool as the simulator wants them."""
        return ContactPoses(self.pool.q[poses], self.pool.normal[poses])

    def _calibrated(
        self,
        sample: Sample,
        arm: CampaignSimulator,
        draws: ErrorDraws,
        numbers: Sequence[int],
        verification: studies.Verification,
    ) -> dict[int, ConditionResult]:
        """Calibrate one arm under conditions with the same load cases, measuring each pose once."""
        chosen = [self.chosen[i].of(sample.generator(studies.Purpose.CHOICE)) for i in numbers]
        poses = np.unique(np.concatenate(chosen))
        pressed = self._pressed(self.conditions[numbers[0]].load_cases)
        cases = tuple(name for name in pressed if name != LIGHT_CONTACT)
        settled = arm.settle(
            self.places(poses),
            np.array([self.presses[name] for name in pressed]),
            seed=2 * sample.number,
            reference=pressed.index(LIGHT_CONTACT) if LIGHT_CONTACT in pressed else None,
        )
        own = draws.take(poses, np.array([self.measured.index(case) for case in cases]))
        found = {}
        for number, order in zip(numbers, chosen, strict=True):
            condition = self.conditions[number]
            scales = ErrorScales(condition.tracker_noise, condition.force_noise)
            station = self.pool.station[poses]
            readings = self.errors.readings(
                settled, own, scales, station, cases, conditioned=CONDITIONING in cases
            )
            mine = readings.take(np.isin(readings.pose, np.searchsorted(poses, order)))
            mine = mine.set_aside(mine.load_case == self.check)
            found[number] = self._fitted(condition.springs, mine, verification)
        return found

    def _pressed(self, spec: str) -> tuple[str, ...]:
        """Return the load cases under a condition: all of them, or some at the reference.

        The load case that checks the fit is pressed too: friction feels it.
        """
        if spec == ALL_LOADS:
            return tuple(self.presses)
        before = (name for name in (CONDITIONING, LIGHT_CONTACT) if name in self.presses)
        return (*before, *training_cases(spec, self.load_cases))

    def _fitted(
        self, springs: str, readings: Readings, verification: studies.Verification
    ) -> ConditionResult:
        """Calibrate as a user would with these springs."""
        model = self.models.get(springs)
        if model is not None:
            return studies.calibrated(model, readings, self.marker, verification)
        options = FitOptions(set_blunders_aside=False)
        choice = choose_model(self.robot, readings, springs, options, self.marker)
        model = choice.model
        told = with_knowledge(options, choice.known, model, readings, self.marker)
        found = studies.calibrated(model, readings, self.marker, verification, told)
        # Each sample may have other springs, so there is no table of their compliances.
        return replace(found, compliance=np.zeros(0))

    def _verification(self, arm: CampaignSimulator, seed: int) -> studies.Verification:
        settled = arm.settle(self.places(self.pool.verification), self.force_tcp, seed=seed)
        flat = (settled.q, settled.force, settled.deflection)
        return studies.Verification(*(array.reshape(-1, array.shape[-1]) for array in flat))
