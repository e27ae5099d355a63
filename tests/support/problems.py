"""Observation systems with a known answer."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, layout
from elastocal.identification import FitOptions, Problem, build
from support.cells import Cell, linear_truth, robot


@cache
def elastic(springs: str = "bearing") -> ElasticModel:
    return ElasticModel(robot(), layout(robot(), springs))


@cache
def campaign(poses: int = 31, seed: int = 0) -> Readings:
    """Return the readings of a simulated campaign, its truth made by other equations."""
    return Cell(linear_truth(), poses=poses, seed=seed).readings()


def linear_readings(
    springs: str = "bearing", sigma: float = 0.0, poses: int = 31, seed: int = 0
) -> tuple[Readings, np.ndarray]:
    """Return readings that the linear model explains but for noise, and its compliances."""
    model, readings = elastic(springs), campaign(poses)
    rng = np.random.default_rng(seed)
    compliance = rng.uniform(2e-7, 2e-6, len(model.springs))
    deflection = model.deflection(compliance, readings.joint_position, readings.force)
    noise = sigma * rng.standard_normal(deflection.shape)
    marker = readings.controller_displacement + deflection + noise
    return replace(readings, marker_displacement=marker), compliance


def planted(
    sigma: float = 0.0,
    poses: int = 31,
    seed: int = 0,
    springs: str = "actuated",
    options: FitOptions | None = None,
) -> tuple[Problem, np.ndarray]:
    """Return a problem and the compliances that made its deflections."""
    readings, compliance = linear_readings(springs, sigma, poses, seed)
    return build(elastic(springs), readings, options), compliance


def made_up(
    rng: np.random.Generator, blocks: int = 8, springs: int = 5, **changes: Any
) -> tuple[Problem, np.ndarray]:
    """Return a problem of random numbers, four readings a pose block, and what made it."""
    readings = 4 * blocks
    O = rng.normal(size=(readings, 3, springs)) * np.logspace(0, 4, springs)  # noqa: E741
    truth = rng.uniform(0.5, 2.0, springs) / np.logspace(0, 4, springs)
    fields: dict[str, Any] = {
        "O": O,
        "d": O @ truth,
        "weight": np.ones((readings, 3)),
        "block": np.repeat(np.arange(blocks), 4),
        "lower": np.zeros(springs),
        "upper": np.full(springs, np.inf),
        "prior_rows": np.zeros((0, springs + 1)),
    }
    return Problem(**(fields | changes)), truth
