"""Production outside of what was calibrated keeps the light from being green, by name."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal.cell import ProductionPath
from elastocal.findings import Finding
from elastocal.verdict import Light, find_everything
from elastocal.verdict.evidence import AcceptanceLimits
from elastocal.verdict.findings import reading_findings
from elastocal.verdict.judgement import judge


@pytest.fixture
def with_production(parts):
    """Return a function that lets production run beside where the model was calibrated."""
    domain = parts.calibrated.model.domain
    robot = parts.calibrated.model.model.robot

    def moved(by: float, joint: int = 0, rows: slice = slice(None)):
        q = np.tile(domain.joint_position[domain.reading_pose], (10, 1))
        q[rows, robot.external_axes + joint] += by
        course = tuple("first" if row < len(q) // 2 else "second" for row in range(len(q)))
        path = ProductionPath(q, np.tile(domain.force, (10, 1)), None, course)
        return replace(parts, cell=replace(parts.cell, process=path))

    return moved


def production(evidence) -> list[Finding]:
    """Return the findings on production."""
    return [each for each in reading_findings(evidence) if "of production" in each]


def test_production_where_it_was_calibrated_is_told_and_holds_nothing_back(with_production):
    (finding,) = production(with_production(0.0))
    print(finding)
    assert not finding.holds_back
    assert finding.startswith("100% of")


def test_production_elsewhere_is_not_green_and_says_what_lies_outside(with_production):
    evidence = with_production(np.radians(100.0))
    (finding,) = production(evidence)
    assert finding.holds_back
    assert "joint_a1 up to 100 deg away" in finding
    assert "process.file" in finding.advice
    limits = AcceptanceLimits(1.0, None, "so wide that nothing else is at fault")
    wide = replace(evidence, limits=limits)
    assert judge(wide, []).light is Light.GREEN
    verdict = judge(wide, [finding])
    assert verdict.light is Light.YELLOW
    assert verdict.reasons == (finding,)


def test_a_few_rows_outside_are_named_and_hold_nothing_back(with_production):
    (finding,) = production(with_production(np.radians(100.0), rows=slice(0, 2)))
    assert not finding.holds_back
    assert finding.endswith("in first")


def test_without_a_process_nothing_is_said_of_production(parts):
    bare = replace(parts, cell=replace(parts.cell, process=None))
    assert bare.coverage is None
    assert not [each for each in find_everything(bare) if "of production" in each]
