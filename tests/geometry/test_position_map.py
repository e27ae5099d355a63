"""Tables of positions whose columns have other names, by a map as for logs."""

import numpy as np
import pytest

import elastocal as ec
from elastocal.errors import ElastocalError, GeometryError, SchemaError
from elastocal.geometry import read_position_map, read_positions
from elastocal.robot import catalogue
from elastocal.workflows import check
from support.measured_arms import measure, write_positions

ARM = catalogue.load("KR 210 R2700-2")
HEADS = {f"{name}[deg]": f"A{n}" for n, name in enumerate(ARM.joint_names, 1)}
HEADS |= {f"marker1_{axis}[mm]": f"T-MAC {axis.upper()} [um]" for axis in "xyz"}
HEADS |= {"station": "Standort", "payload[kg]": "Last"}


@pytest.fixture
def files(tmp_path):
    """Return a table as elastocal has it, one as a lab has it, and the map."""
    own = write_positions(tmp_path / "own.csv", measure(ARM, 40, markers=1))
    head, *rows = own.read_text(encoding="utf-8").splitlines()
    theirs = tmp_path / "lab.csv"
    names = [HEADS[name] for name in head.split(",")]
    text = [",".join([*names, "Bemerkung"]), *(f"{row},gut" for row in rows)]
    theirs.write_text("\n".join(text) + "\n", encoding="utf-8")
    lines = ["schema: elastocal.position-map/1", "columns:"]
    for name, their in HEADS.items():
        bare, _, unit = name.removesuffix("]").partition("[")
        lines.append(f"  {bare}: {{column: '{their}'{f', unit: {unit}' if unit else ''}}}")
    mapped = tmp_path / "map.yaml"
    mapped.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return own, theirs, mapped


def test_a_mapped_table_is_read_as_its_twin_and_what_is_not_mapped_is_left_out(files):
    own, theirs, mapped = files
    known, found = read_positions(own, ARM), read_positions(theirs, ARM, read_position_map(mapped))
    np.testing.assert_array_equal(found.q, known.q)
    np.testing.assert_array_equal(found.markers, known.markers)
    np.testing.assert_array_equal(found.station, known.station)
    assert check(mapped).holds["columns"]["joint_a1"] == "A1"


def test_a_head_serves_without_its_unit_which_it_then_states_itself(files):
    own, theirs, mapped = files
    text = mapped.read_text(encoding="utf-8").replace(" [um]', unit: mm", "'")
    mapped.write_text(text, encoding="utf-8")
    found = read_positions(theirs, ARM, read_position_map(mapped))
    np.testing.assert_allclose(found.markers, 1e-3 * read_positions(own, ARM).markers)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("'A3'", "'A7'", "takes 'joint_a3' from a column 'A7', which the table does not have"),
        ("'A3'", "'A2'", "takes column 'A2' twice"),
        ("joint_a3:", "joint_b3:", r"column 'joint_a3\[…\]' is missing"),
        ("unit: deg", "unit: kg", "kg"),
        ("columns:", "colums:", "unknown key 'colums'; did you mean 'columns'"),
        ("position-map/1", "position-map/9", "position-map/9"),
        ("{column: 'A3', unit: deg}", "A3", "joint_a3"),
    ],
)
def test_a_map_that_does_not_fit_is_refused_in_one_line(files, old, new, message):
    _, theirs, mapped = files
    text = mapped.read_text(encoding="utf-8").replace(old, new, 1)
    mapped.write_text(text, encoding="utf-8")
    with pytest.raises((GeometryError, SchemaError, ElastocalError), match=message) as refused:
        read_positions(theirs, ARM, read_position_map(mapped))
    assert "\n" not in str(refused.value)


def test_the_command_takes_the_map(files):
    own, theirs, mapped = files
    plain = ec.geometry(own, robot="KR 210 R2700-2", tcp=ARM.tip)
    found = ec.geometry(theirs, robot="KR 210 R2700-2", tcp=ARM.tip, map=mapped)
    assert found.model.held_out == plain.model.held_out
