"""Pairs of calibrations of one simulated cell, unchanged or with a softened gear."""

from dataclasses import replace
from functools import cache

import numpy as np

from elastocal.elastic import ElasticModel, layout
from elastocal.identification import CalibratedModel, Observability, Term, calibrate
from elastocal.sim.arm import Linear
from elastocal.sim.arm.elastic_arm import ElasticArm
from elastocal.sim.arm.gears import StiffeningGear
from support.cells import Cell, linear_truth, robot
from support.problems import elastic

SOFTER = 1.2
"""Compliance of the softened gear over what it was."""


def softened(arm: ElasticArm, joint: str = "joint_3", by: float = SOFTER) -> ElasticArm:
    """Return the arm with the gear of one joint more compliant."""
    number = arm.linkage.joint_names.index(joint)
    axis, found = tuple(arm.linkage.axis[number]), 0
    springs = []
    for spring in arm.springs:
        if spring.joint == joint and spring.axis == axis and not any(spring.at):
            spring, found = replace(spring, law=_softer(spring.law, by)), found + 1
        springs.append(spring)
    assert found == 1
    return replace(arm, springs=tuple(springs))


def _softer(law, by: float):
    assert isinstance(law, Linear | StiffeningGear)
    return replace(law, k=law.k / by)


@cache
def calibrated(
    arm: ElasticArm, seed: int, springs: str = "bearing-joint", poses: int = 31
) -> CalibratedModel:
    """Return the calibration of a campaign; all bootstraps have one seed, as by default."""
    model = ElasticModel(robot(), layout(robot(), springs))
    readings = Cell(arm, seed=seed, poses=poses).readings()
    found = calibrate(model, readings, np.random.default_rng(0)).calibrated
    return replace(found, provenance=f"campaign {seed}; plan 0123456789ab")


@cache
def soft_truth() -> ElasticArm:
    return softened(linear_truth())


def made_up(
    seed: int,
    sigma: float = 1e-8,
    compliance: np.ndarray | None = None,
    unobservable: tuple[tuple[Term, ...], ...] = (),
    draws: int = 200,
    springs: str = "actuated",
) -> CalibratedModel:
    """Return a model with normal errors of one size, and draws that say so."""
    model, rng = elastic(springs), np.random.default_rng(seed)
    truth = np.full(len(model.springs), 1e-6) if compliance is None else compliance
    estimate = truth + sigma * rng.standard_normal(len(truth))
    scatter = estimate + sigma * rng.standard_normal((draws, len(truth)))
    mixed = {term.spring for group in unobservable for term in group}
    seen = Observability(
        len(truth) - len(unobservable), 10.0,
        tuple(name not in mixed for name in model.spring_names), unobservable,
    )  # fmt: skip
    return CalibratedModel(model, estimate, scatter, seen, f"made up {seed}")
