"""The command shows the softest spring first."""

import pytest
from elastocal_softest import COMMAND, Settings, Softest

from elastocal.blocks import Table
from elastocal.errors import IdentificationError
from elastocal.plugins import load


def test_it_is_the_command_that_its_entry_point_names():
    assert load("command", "softest") is COMMAND


def test_the_table_has_a_row_a_spring():
    _, table = COMMAND.show(Softest("Arm", {"a": 2e-6, "b": 1e-6}))
    assert isinstance(table, Table)
    assert table.rows == (("a", "2.000"), ("b", "1.000"))


def test_no_spring_is_refused():
    with pytest.raises(IdentificationError, match="--most 0"):
        COMMAND.run(Settings("model.json", 0))
