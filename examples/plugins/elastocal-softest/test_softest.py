"""The command keeps what every command keeps, and shows the softest spring first."""

import numpy as np
import pytest
from elastocal_softest import COMMAND, Settings, Softest

from elastocal.blocks import Table
from elastocal.elastic import ElasticModel, actuated
from elastocal.errors import IdentificationError
from elastocal.identification import CalibratedModel, Observability, write_model
from elastocal.plugins import load
from elastocal.robot import catalogue
from elastocal.testing import CommandSuite


class TestSoftestCommand(CommandSuite):
    @pytest.fixture
    def command(self):
        return "softest"

    @pytest.fixture
    def arguments(self, tmp_path):
        robot = catalogue.load("UR20")
        model = ElasticModel(robot, actuated(robot))
        compliance = np.linspace(1e-6, 2e-6, 6)
        seen = Observability(6, 1.0, (True,) * 6, ())
        draws = np.tile(compliance, (40, 1))
        path = tmp_path / "model.json"
        write_model(path, CalibratedModel(model, compliance, draws, seen))
        return path, "--most", 3


def test_it_is_the_command_that_its_entry_point_names():
    assert load("command", "softest") is COMMAND


def test_the_table_has_a_row_a_spring():
    _, table = COMMAND.show(Softest("Arm", {"a": 2e-6, "b": 1e-6}))
    assert isinstance(table, Table)
    assert table.rows == (("a", "2.000"), ("b", "1.000"))


def test_no_spring_is_refused():
    with pytest.raises(IdentificationError, match="--most 0"):
        COMMAND.run(Settings("model.json", 0))
