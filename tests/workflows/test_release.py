"""``release`` on the simulated rig: what is said before, what is moved, and what is measured."""

import numpy as np
import pytest

from elastocal.cell import SensorStatus, WrenchBlock
from elastocal.procedure.run import FaultError, LeavingWatch, ToolLoad
from elastocal.workflows import release
from elastocal.workflows._operator_and_devices import Unattended
from support.simulated import example_cell

UP = np.array([0.0, 0.0, 1.0])
LOAD = ToolLoad(np.array([0.0, 0.0, -600.0]), np.eye(3), 1000.0)


class Heard(Unattended):
    def __init__(self):
        self.lines = []

    def warn(self, lines):
        self.lines += lines


def test_it_says_place_force_way_and_rule_before_it_moves():
    operator = Heard()
    figures = release(example_cell("afp").path, operator=operator).figures
    said = "\n".join(operator.lines)
    assert "the tool stands at" in said
    assert "on the tool beyond its weight, as in free air (limit" in said
    assert "10 mm at 2 mm/s, then 90 mm at 20 mm/s, along -z of the tool" in said
    assert "it stops where the force grows by 50 N" in said
    assert figures.moved
    assert figures.message.startswith("retracted by 100.0 mm; ")


def block(force, status=SensorStatus.OK):
    values = np.array([force], dtype=float)
    return WrenchBlock(np.zeros(1), values, 0.0 * values, 0.1, 0.1, status, "sensor")


def test_a_force_that_falls_and_then_only_shows_a_bias_is_let_pass():
    watch = LeavingWatch(LOAD, UP, 50.0)
    for press in (1100.0, 600.0, 0.0, -120.0):
        watch.look(block([0.0, 30.0, press - 600.0]), np.eye(4))
    assert watch.force == -120.0


@pytest.mark.parametrize(
    ("forces", "message"),
    [
        ((500.0, 400.0, 451.0), "it grew from 400 N to 451 N"),
        ((0.0, -400.0), "400 N hold the tool"),
    ],
)
def test_a_force_that_grows_or_holds_the_tool_back_is_a_fault(forces, message):
    watch = LeavingWatch(LOAD, UP, 50.0)
    *before, last = (block([0.0, 0.0, press - 600.0]) for press in forces)
    for each in before:
        watch.look(each, np.eye(4))
    with pytest.raises(FaultError, match=message):
        watch.look(last, np.eye(4))


@pytest.mark.parametrize(
    "bad", [block([np.nan, 0.0, 0.0]), block([9e9, 0.0, 0.0], SensorStatus.SATURATED)]
)
def test_a_force_that_cannot_be_trusted_is_none(bad):
    assert LOAD.beyond_weight(bad, np.eye(4)) is None


def test_without_a_mass_no_force_is_called_a_press():
    massless = ToolLoad(np.zeros(3), np.eye(3), 1000.0)
    assert massless.tolerance == np.inf
