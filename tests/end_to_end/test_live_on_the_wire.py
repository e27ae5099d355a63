"""A live compensation over loopback, against the simulated controller and the simulated box."""

import json

import numpy as np
import pytest

from elastocal import workflows
from support.live_on_wire import LiveFiles, served

BIAS = 250.0
"""A bias that the tool file states and the sensor has not, in N: as good as a force."""


def corrected(folder, cycles, act=lambda _robot, _box: None, **options):
    """Correct for some cycles; return the result and where the controller's correction ended."""
    files = LiveFiles.written(folder / "files", BIAS)
    with served(files) as (robot, box):

        def interrupted():
            act(robot, box)
            return robot.statistics.answered > cycles

        result = workflows.live(
            files.cell, model=files.model, tool=files.tool, arm=True, out=folder / "out",
            interrupted=interrupted, **options,
        )  # fmt: skip
        return result, robot.statistics, robot._robot._offset[0]


@pytest.mark.end_to_end
def test_what_is_sent_is_what_the_log_says_and_it_ends_at_zero(tmp_path):
    result, counts, offset = corrected(tmp_path, 200)
    assert result.problem is None
    assert result.line.answered >= 200
    assert (result.line.malformed, result.line.foreign, result.loop.restarts) == (0, 0, 1)
    assert 5e-5 < result.loop.largest_correction <= 1e-3 * (1 + 1e-9)
    assert counts.stops in ([], ["program ended"])
    np.testing.assert_array_equal(offset, np.zeros(3))
    assert result.logged == result.loop.cycles
    record = json.loads((tmp_path / "out" / "live.json").read_text())
    assert record["line"]["answer_p50"] > 0.0


@pytest.mark.slow
@pytest.mark.end_to_end
def test_a_minute_with_a_stream_that_stops_for_a_second(tmp_path):
    def act(robot, box):
        gone = 5000 < robot.statistics.answered < 5250
        box.box.lose = 10**6 if gone else 0

    result, counts, _ = corrected(tmp_path, 15_000, act)
    assert result.loop.cycles >= 15_000
    assert result.loop.faded > 150
    assert result.loop.largest_step <= 0.03 * 0.004 * (1 + 1e-9)
    assert result.loop.restarts == 1 + result.line.jumps
    assert result.logged + result.dropped == result.loop.cycles
    assert counts.stops in ([], ["program ended"])
