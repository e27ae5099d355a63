"""The time of one visit of a pose: ways at their speeds, ramps at their rate, waits."""

import numpy as np
import pytest

from elastocal.cell import contact_time, load_case_time, load_cell, straight_time
from elastocal.cell.examples import write_example


def test_a_pose_takes_its_approach_its_reference_and_its_load_cases(tmp_path):
    cell = load_cell(write_example(tmp_path, "afp")[0])
    p, near, far, count = cell.file.procedure, 0.003, 0.097, len(cell.file.presses)
    ways = 2 * far / p.approach_speed + near / p.contact_speed + near / p.approach_speed
    loads = [np.array([0.0, 0.0, -p.contact_force]), *cell.file.presses.values(), np.zeros(3)]
    ramps = np.linalg.norm(np.diff(loads, axis=0), axis=1).sum() / p.ramp
    still = p.dwell + 2 * (p.dwell + p.unloaded_average) + count * (p.dwell + p.average)
    cycles = (8 + 3 * count) * p.cycle
    assert contact_time(cell) == pytest.approx(ways + ramps + still + cycles)
    assert straight_time(cell) == pytest.approx(ways + 4 * p.cycle)
    settled = count * load_case_time(cell) - count * (p.dwell + p.average + 3 * p.cycle)
    assert settled == pytest.approx(ramps - np.linalg.norm(loads[-2]) / p.ramp)
