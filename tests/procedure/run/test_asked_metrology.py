"""A run whose marker is measured when it is asked for, by a person."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal.cell import BeamState
from elastocal.procedure import RunEnd, read_journal
from elastocal.procedure.record import ReadingStatus
from support.fake_devices import FakeTracker
from support.fake_runs import FakeRun


class AskedTracker(FakeTracker):
    """Measures once a question, some looks later; then says the same until the next."""

    late = 5

    def __init__(self, world):
        super().__init__(world)
        self.asked, self.left, self.reading = [], 0, None

    def ask(self, what):
        self.asked.append(what)
        self.left, self.reading = self.late, None

    def read(self):
        block = super().read()
        if self.reading is None and self.asked and len(block):
            self.left -= 1
            if self.left < 0:
                self.reading = block.position[-1]
        if self.reading is None:
            nothing = np.empty((0, 3))
            return replace(
                block,
                time=np.empty(0),
                position=nothing,
                sigma=nothing,
                beam=BeamState.BROKEN,
                note="nobody has typed a reading",
            )
        return replace(block, position=np.tile(self.reading, (len(block), 1)))


@pytest.mark.parametrize("late", [0, 5])
def test_each_reading_is_asked_for_when_the_arm_stands(tmp_path, late):
    run = FakeRun(tmp_path / "run")

    def prepare(cell):
        cell.tracker = AskedTracker(cell.world)
        cell.tracker.late = late

    assert run.start(prepare).end is RunEnd.DONE
    steps = ["aim", "unloaded", "normal", "north"]
    asked = list(dict.fromkeys(run.cell.tracker.asked))  # a window may be repeated
    assert asked == [f"pose {n}, {step}" for n in (0, 1) for step in steps]
    windows = [w for e in read_journal(run.journal) if e.log for w in e.log.windows]
    assert {window.status for window in windows} == {ReadingStatus.OK}
    unloaded, pressed = (run.readings()[0, case][3:] for case in (None, "normal"))
    assert 0.0 < np.linalg.norm(pressed - unloaded) < 1e-3


def test_a_person_who_does_not_answer_is_a_lost_beam_with_the_reason(tmp_path):
    run = FakeRun(tmp_path / "run", changes={"retries": 0})

    def prepare(cell):
        cell.tracker = AskedTracker(cell.world)
        cell.tracker.late = 10**6

    result = run.start(prepare)
    assert result.given_up == (0, 1)
    texts = [entry.text for entry in read_journal(run.journal) if "beam lost" in entry.text]
    assert any("nobody has typed a reading" in text for text in texts)
