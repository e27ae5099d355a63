"""Readings that a person types."""

import os
import queue
import threading

import numpy as np
import pytest

from elastocal.cell import AskedMetrology, BeamState
from elastocal.drivers.operator_entry import DRIVER
from elastocal.drivers.operator_entry.entry import OperatorEntry, appended_lines
from elastocal.errors import DeviceError
from elastocal.sim.workcell import SimClock
from support.simulated import example_cell
from support.stations_on_wire import connect
from support.waiting import until

WANTED = "pose 3, north"


class Person:
    """Types lines, and reads what is said."""

    def __init__(self):
        self.lines, self.heard = queue.Queue(), []

    def types(self, line):
        count = len(self.heard)
        self.lines.put(line)
        until(lambda: len(self.heard) > count)

    def __iter__(self):
        return iter(self.lines.get, None)


@pytest.fixture
def clock():
    return SimClock(5.0)


@pytest.fixture
def person():
    return Person()


def entry(clock, person, **settings):
    model = DRIVER.settings("metrology").model_validate(settings)
    return OperatorEntry(example_cell(), model, clock, iter(person), person.heard.append)


def test_a_reading_stands_until_the_next_is_asked_for(clock, person):
    metrology = entry(clock, person)
    assert isinstance(metrology, AskedMetrology)
    assert metrology.read().beam is BeamState.BROKEN
    metrology.ask(WANTED)
    assert person.heard == [f"{WANTED}: x y z of the marker from station_1, in mm"]
    assert len(metrology.read()) == 0
    person.types("2412.071 -310.442 1203.118")
    for _ in range(3):
        block = metrology.read()
        np.testing.assert_allclose(block.position, [[2.412071, -0.310442, 1.203118]])
        assert block.beam is BeamState.LOCKED
        assert block.time[0] == clock.now()
        clock.sleep(0.25)
    metrology.ask("pose 3, south")
    assert metrology.read().beam is BeamState.BROKEN


def test_the_mean_of_a_window_is_as_uncertain_as_the_one_reading(clock, person):
    metrology = entry(clock, person, sigma="30 um")
    metrology.ask(WANTED)
    person.types("2412 -310 1203")
    blocks = []
    for _ in range(25):
        clock.sleep(0.04)
        blocks.append(metrology.read())
    sigma = np.concatenate([block.sigma for block in blocks])
    assert np.sqrt((sigma[:, 0] ** 2).mean() / len(sigma)) == pytest.approx(30e-6, rel=0.15)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("2412 -310", "three numbers are wanted; type it again"),
        ("2.4 -0.3 1.2", "that is 0.0027 m from station_1, whose range is 1 m to 15 m: in mm?"),
        ("x y z", "three numbers"),
        ("nan 1 2", "in mm?"),
        ("9" * 300, "more than 200 characters"),
    ],
)
def test_what_is_no_reading_is_told_and_typed_again(clock, person, line, message):
    metrology = entry(clock, person)
    metrology.ask(WANTED)
    person.types(line)
    assert message in person.heard[-1]
    assert metrology.read().beam is BeamState.BROKEN
    person.types("2412,071; -310,442; 1203,118")
    assert metrology.read().beam is BeamState.LOCKED


def test_a_line_that_nobody_has_asked_for_is_no_reading(clock, person):
    metrology = entry(clock, person)
    metrology.ask(WANTED)
    person.types("2412 -310 1203")
    person.types("3412 -310 1203")
    assert "no reading is asked for now" in person.heard[-1]
    assert metrology.read().position[0, 0] == 2.412


def test_what_is_typed_before_the_first_question_is_left_to_others(clock):
    taken = []
    lines = (taken.append(line) or line for line in ("yes", "2412 -310 1203"))
    metrology = OperatorEntry(
        example_cell(), DRIVER.settings("metrology")(), clock, lines, lambda _: None
    )
    metrology.look("station_1")
    metrology.read()
    assert taken == []
    metrology.ask(WANTED)
    until(lambda: len(taken) == 2)


def test_an_operator_who_does_not_come_ends_the_run(clock, person):
    metrology = entry(clock, person, within="600 s")
    metrology.ask(WANTED)
    clock.sleep(601.0)
    with pytest.raises(DeviceError, match=f"no reading within 600 s of '{WANTED}'"):
        metrology.read()


def test_an_input_that_ends_is_a_fault(clock):
    model = DRIVER.settings("metrology")()
    metrology = OperatorEntry(example_cell(), model, clock, iter(()), lambda _: None)
    metrology.ask(WANTED)
    metrology._thread.join()
    with pytest.raises(DeviceError, match="its input has ended"):
        metrology.read()


def test_lines_appended_to_a_file_are_readings(clock, tmp_path):
    path, done = tmp_path / "readings.txt", threading.Event()
    path.write_text("old\n")
    lines = appended_lines(path, done)
    found = []
    reader = threading.Thread(target=lambda: found.extend([next(lines), next(lines)]))
    reader.start()
    # The file is looked at when the thread begins: what is appended before is old.
    until(lambda: (lines.gi_frame is not None and lines.gi_running) or reader.is_alive())
    threading.Event().wait(0.2)
    with path.open("a") as file:
        file.write("1 2 3\n4 5")
    threading.Event().wait(0.2)
    with path.open("a") as file:
        file.write(" 6\n")
    reader.join(10.0)
    assert found == ["1 2 3", "4 5 6"]
    done.set()


def test_a_procedure_that_leaves_a_person_no_time_is_refused(clock):
    with pytest.raises(DeviceError, match=r"procedure.beam_timeout is 5 s: a person"):
        connect(DRIVER, example_cell(), clock)


def test_where_nobody_can_type_it_is_refused_before_anything_moves(clock, tmp_path, monkeypatch):
    """The studio runs an arm in a process of its own, whose standard input is empty."""
    patient = example_cell("afp", procedure={"beam_timeout": "120 s"})
    with open(os.devnull, encoding="utf-8") as nobody:  # noqa: PTH123 - it is no file of ours
        monkeypatch.setattr("sys.stdin", nobody)
        with pytest.raises(DeviceError, match=r"nobody can type points here.*\(key 'file'\)"):
            connect(DRIVER, patient, clock)
        connect(DRIVER, patient, clock, file=str(tmp_path / "points.txt")).close()
    with (tmp_path / "typed").open("w+", encoding="utf-8") as piped:
        monkeypatch.setattr("sys.stdin", piped)
        connect(DRIVER, patient, clock).close()
