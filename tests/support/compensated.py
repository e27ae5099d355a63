"""Calibrated models with known compliances, for compensators and their C."""

from functools import cache

import numpy as np

from elastocal.cell import SensorLoad, load_cell, weight_response
from elastocal.cell.examples import write_example
from elastocal.compensation import CompensatorSettings
from elastocal.elastic import ElasticModel, Spring, layout
from elastocal.identification import CalibratedModel, Observability
from elastocal.robot import Robot
from support.virtual_chain import ARMS

SCALE = np.repeat([1.0, 0.1], 3)
"""Of forces in N and moments in N·m, as a sensor's ranges are to one another."""


def calibrated(robot: Robot, springs: tuple[Spring, ...] | None = None, seed: int = 0):
    """Return a model with made-up compliances and draws."""
    model = ElasticModel(robot, layout(robot, "bearing") if springs is None else springs)
    n, rng = len(model.springs), np.random.default_rng(seed)
    compliance = rng.uniform(5e-8, 8e-7, n)
    draws = compliance * (1.0 + 0.1 * rng.normal(size=(50, n)))
    seen = Observability(n, 1.0, (True,) * n, ())
    return CalibratedModel(model, compliance, draws, seen, "made up")


@cache
def arm(name: str = "six axes") -> CalibratedModel:
    return calibrated(Robot.from_urdf(ARMS[name], "tcp"))


def example_robot(like: str, folder) -> Robot:
    """Return the robot of an example cell, its rail included."""
    return load_cell(write_example(folder, like)[0]).robot


def load() -> SensorLoad:
    """Return a heavy tool on a sensor with cross-talk that sits turned and behind the tcp."""
    T, rng = np.eye(4), np.random.default_rng(4)
    T[:3, :3] = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    T[:3, 3] = (0.01, -0.02, -0.35)
    return SensorLoad(
        mass=23.0,
        centre=np.array([0.01, -0.005, 0.12]),
        force_bias=np.array([12.0, -30.0, 5.0]),
        moment_bias=np.array([0.4, 1.0, -2.0]),
        T_tcp_sensor=T,
        matrix=np.eye(6) + 0.01 * rng.normal(size=(6, 6)) * np.divide.outer(SCALE, SCALE),
        response=weight_response(23.0, np.array([0.01, -0.005, 0.12])) + rng.normal(size=(6, 3)),
    )


def settings(**changes) -> CompensatorSettings:
    """Return settings with every kind of filter."""
    usual = {
        "deadband": "0.01 mm",
        "uncertain_above": "5 mm",
        "filter": {
            "median": 3,
            "notches": [{"frequency": "50 Hz", "width": "10 Hz"}],
            "low_pass": {"cutoff": "15 Hz", "order": 4},
        },
        "sensor": {"force": ["2500 N"] * 3, "moment": ["400 N*m"] * 3},
    }
    return CompensatorSettings(**(usual | changes))
