"""A small study without a cell: settings, and a stand-in for the simulator."""

import numpy as np

from elastocal.codec.study import (
    Condition,
    ConditionResult,
    Purpose,
    Sample,
    SampleResult,
    SpringLabel,
    StudyDesign,
)
from elastocal.errors import ProcedureError

SPRINGS = (SpringLabel(name="joint_1.axial", unit="rad/(N*m)"),)


def settings(*poses: int, **changes: object) -> StudyDesign:
    """Return the settings of a study of some pose counts."""
    conditions = tuple(Condition(poses=count) for count in poses or (5, 10))
    values = {
        "cell": "cell",
        "cell_fingerprint": "a" * 64,
        "simulation_fingerprint": "b" * 64,
        "seed": 3,
        "pool": 100,
        "verification": 20,
        "load_cases": ("normal",),
        "conditions": conditions,
        "springs": {"bearing": SPRINGS},
        "versions": {"elastocal": "0"},
    }
    return StudyDesign(**(values | changes))


def simulate(sample: Sample) -> SampleResult:
    """Return numbers that only the sample's own generators decide."""
    error = sample.generator(Purpose.ERRORS).uniform(1e-5, 9e-5, 2)
    compliance = sample.generator(Purpose.TRUTH).uniform(1e-7, 2e-7, (2, 1))
    outcomes = tuple(
        ConditionResult(float(e), float(3 * e), 1e-3, np.array(c))
        for e, c in zip(error, compliance, strict=True)
    )
    return SampleResult(sample.number, outcomes)


def numbers(results: object) -> list[tuple[object, ...]]:
    """Return results as plain numbers, to be compared bit for bit."""
    return [
        (result.number, *_errors(each), tuple(each.compliance.tolist()))
        for result in results  # type: ignore[attr-defined]
        for each in result.outcomes
    ]


def _errors(each: ConditionResult) -> tuple[float, float, float]:
    return each.error_mean, each.error_max, each.deflection_mean


def batch(numbers):
    """Return a batch of samples; processes find it here, not in a module of tests."""
    return [simulate(Sample(3, number)) for number in numbers]


def refuse(_):
    """Refuse a batch, as a cell that cannot be simulated does."""
    raise ProcedureError("enough")


def lack(_):
    """Fail as on a worker where a package is missing."""
    raise ModuleNotFoundError("No module named 'pinocchio'", name="pinocchio")


def strides(array, _):
    """Return how an array lies in the memory of a worker: sums over it are rounded by that."""
    return array.strides
