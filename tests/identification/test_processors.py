"""What is decided about a campaign is the same on every processor; see decision 107."""

import json
import os
import platform
import subprocess
import sys

import pytest

from support.decisions import CORE_TYPES, differences, furthest, under
from support.demos import finished_demo

pytestmark = pytest.mark.skipif(
    platform.machine() not in ("x86_64", "AMD64"), reason="core types of OpenBLAS on x86-64"
)


@pytest.mark.slow
def test_two_core_types_decide_alike_on_published_and_simulated_readings():
    """Every other test meets three, one in each process; see `support.processors`."""
    # The published readings of a FANUC (-1), and a campaign with bounds that leave them no part.
    numbers = (-1, 33)
    first, other = under("Prescott", numbers), under("Haswell", numbers)
    assert list(differences(first, other)) == []
    assert furthest(first, other)[0] < 0.05


@pytest.mark.slow
def test_core_types_decide_alike_on_two_hundred_campaigns():
    numbers = range(-1, 200)
    found = {core_type: under(core_type, numbers) for core_type in CORE_TYPES}
    first = found[CORE_TYPES[0]]
    lines = [
        f"{core_type}: {line}"
        for core_type, each in found.items()
        for line in differences(first, each)
    ]
    print({core_type: furthest(first, each) for core_type, each in found.items()})
    assert lines == []


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["afp", "machining"])
def test_core_types_judge_a_demo_alike(kind, tmp_path):
    demo = finished_demo(kind)
    found = []
    for core_type in CORE_TYPES:
        model = tmp_path / f"{core_type}.json"
        calibrated = _told(core_type, "calibrate", demo / "run" / "dataset.nc", "--out", model)
        page = tmp_path / f"{core_type}.html"
        judged = _told(core_type, "report", demo / "run", "--out", page)
        springs = [
            [each[key] for key in ("name", "observable", "group", "at_bound", "too_weak")]
            for each in calibrated["springs"]
        ]
        chosen = [each["springs"] for each in calibrated["ladder"] if each["chosen"]]
        verdict = judged["verdict"]
        said = verdict
        found.append((chosen, springs, calibrated["rank"], said))
    assert all(each == found[0] for each in found)


def _told(core_type, *arguments):
    environment = {**os.environ, "OPENBLAS_CORETYPE": core_type}
    done = subprocess.run(
        [sys.executable, "-m", "elastocal", *map(str, arguments), "--json"],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(done.stdout)
