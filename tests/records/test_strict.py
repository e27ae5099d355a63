import json
from typing import Literal

import pytest

from elastocal.errors import FileAccessError, SchemaError
from elastocal.records import (
    StrictModel,
    check_schema,
    read_json,
    read_json_data,
    read_yaml,
    validate,
)


class Station(StrictModel):
    name: str
    height: float = 1.0


class Cell(StrictModel):
    robot: str
    kind: Literal["afp", "machining"] = "afp"
    stations: tuple[Station, ...] = ()
    spare: Station | None = None
    by_name: dict[str, Station] | None = None
    count: int = 1
    switch: bool = False
    axis: tuple[float, float] | None = None
    margins: dict[str, float] | None = None


SCHEMA = "elastocal.cell/1"
GOOD = {"schema": SCHEMA, "robot": "arm", "stations": [{"name": "a", "height": 2}]}


@pytest.fixture(params=[(read_yaml, "cell.yaml"), (read_json, "cell.json")], ids=["yaml", "json"])
def read(request, tmp_path):
    reader, name = request.param

    def of(data):
        path = tmp_path / name
        path.write_text(data if isinstance(data, str) else json.dumps(data))
        return reader(path, Cell, SCHEMA)

    return of


def test_a_good_file_is_a_frozen_model(read):
    cell = read(GOOD)
    assert cell == Cell(robot="arm", stations=(Station(name="a", height=2.0),))
    with pytest.raises(ValueError, match="frozen"):
        cell.robot = "other"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"robto": 1}, r"unknown key 'robto'; did you mean 'robot'\? \(known: robot, kind"),
        ({"stations": [{"name": "a", "hight": 1}]}, r"'stations\.0\.hight'; did you mean 'height'"),
        ({"spare": {"nam": "a", "name": "b"}}, r"'spare\.nam'; did you mean 'name'"),
        ({"by_name": {"x": {"name": "b", "size": 1}}}, r"'by_name\.x\.size' \(known: name, height"),
        ({"stations": [{"height": 1}]}, r"key 'stations\.0\.name' is missing"),
        ({"count": True}, "count: must be a number, got True"),
        ({"axis": [False, 1]}, r"axis: must be a number, got \[False, 1\]"),
        ({"margins": {"a": True}}, "margins: must be a number"),
        ({"spare": {"name": "a", "height": True}}, r"spare\.height: must be a number, got True"),
        ({"stations": [{"name": "a", "height": True}]}, r"stations\.0\.height: must be a number"),
        ({"kind": "milling"}, "kind: .*'afp' or 'machining', got 'milling'"),
        ({"stations": [{"name": "a", "height": "tall"}]}, r"stations\.0\.height: .*got 'tall'"),
        (
            {"schema": "elastocal.cell/2"},
            f"schema 'elastocal.cell/2'; this version reads '{SCHEMA}'",
        ),
        ({"schema": None}, "schema None"),
    ],
)
def test_a_file_that_does_not_fit_is_refused_in_one_line_by_its_place(read, changes, message):
    with pytest.raises(SchemaError, match=message) as refusal:
        read(GOOD | changes)
    assert "\n" not in str(refusal.value)
    assert "cell." in str(refusal.value)


def test_a_truth_value_stays_one_where_it_is_wanted(read):
    assert read(GOOD | {"switch": True}).switch is True


def test_a_long_value_is_left_out_of_the_message(read):
    with pytest.raises(SchemaError, match=r"kind: .*'afp' or 'machining'$"):
        read(GOOD | {"kind": "m" * 61})


def test_a_number_of_thousands_of_digits_is_refused(tmp_path):
    path = tmp_path / "cell.yaml"
    path.write_text(f"schema: {SCHEMA}\nrobot: arm\nkind: {'9' * 5000}\n")
    with pytest.raises(SchemaError, match="thousands of digits"):
        read_yaml(path, Cell, SCHEMA)


@pytest.mark.parametrize("number", ["1_0", "0x10", "0b11", "1:30", "1_0.5", '"1_0"', "\u0661"])
def test_only_python_or_yaml_would_take_it_for_a_number(tmp_path, number):
    path = tmp_path / "cell.yaml"
    path.write_text(f"schema: {SCHEMA}\nrobot: arm\nmargins: {{a: {number}}}\n", "utf-8")
    with pytest.raises(SchemaError, match="margins"):
        read_yaml(path, Cell, SCHEMA)


@pytest.mark.parametrize(("number", "value"), [("010", 10.0), ("1.5e+3", 1500.0), ("-2", -2.0)])
def test_a_number_is_read_as_a_person_reads_it(tmp_path, number, value):
    path = tmp_path / "cell.yaml"
    path.write_text(f"schema: {SCHEMA}\nrobot: arm\nmargins: {{a: {number}}}\n", "utf-8")
    assert read_yaml(path, Cell, SCHEMA).margins == {"a": value}


@pytest.mark.parametrize("data", [[1, 2], "3", "null"])
def test_a_file_without_keys_is_refused(read, data):
    with pytest.raises(SchemaError, match=SCHEMA):
        read(data)


@pytest.mark.parametrize("text", ["{", "a: b: c", "{a: [", "\t- x: ]"])
def test_a_file_of_another_syntax_is_refused_in_one_line(read, text):
    with pytest.raises(SchemaError, match=r"cell\.\w+ is not valid (YAML|JSON)") as refusal:
        read(text)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("value", ["2024-13-45", "!!int 0x_", "!!python/name:os.system"])
def test_a_yaml_value_that_cannot_be_made_is_refused(tmp_path, value):
    path = tmp_path / "cell.yaml"
    path.write_text(f"robot: {value}\n")
    with pytest.raises(SchemaError, match=r"cell\.yaml is not valid YAML"):
        read_yaml(path, Cell, SCHEMA)


@pytest.mark.parametrize("value", [".nan", ".inf", "-.inf"])
def test_a_number_that_is_not_finite_is_refused(tmp_path, value):
    path = tmp_path / "cell.yaml"
    path.write_text(f"schema: {SCHEMA}\nrobot: a\nspare: {{name: b, height: {value}}}\n")
    with pytest.raises(SchemaError, match=r"spare\.height: .*finite"):
        read_yaml(path, Cell, SCHEMA)


def test_a_key_that_stands_twice_is_refused(tmp_path):
    path = tmp_path / "cell.yaml"
    path.write_text(f"schema: {SCHEMA}\nrobot: a\nrobot: b\n")
    with pytest.raises(SchemaError, match="'robot' stands twice"):
        read_yaml(path, Cell, SCHEMA)


def test_a_key_that_is_no_text_is_refused(tmp_path):
    path = tmp_path / "cell.yaml"
    path.write_text(f"schema: {SCHEMA}\nrobot: a\n1: 2\n")
    with pytest.raises(SchemaError, match=r"cell\.yaml: 1"):
        read_yaml(path, Cell, SCHEMA)


def test_a_missing_file_is_refused_by_its_path(tmp_path):
    with pytest.raises(FileAccessError, match="none"):
        read_yaml(tmp_path / "none", Cell, SCHEMA)


def test_the_first_problem_of_several_is_named():
    with pytest.raises(SchemaError, match="what: key 'robot' is missing"):
        validate({"kind": 3}, Cell, "what")


def test_a_misspelt_key_is_named_rather_than_the_one_that_is_missing_for_it():
    with pytest.raises(SchemaError, match="unknown key 'robott'; did you mean 'robot'"):
        validate({"kind": 3, "robott": "a"}, Cell, "what")


def test_the_known_schema_passes():
    check_schema(SCHEMA, SCHEMA, "a file")


ALIASES = "a0: &a0 [x, x]\n" + "".join(
    f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 4)}]\n" for n in range(1, 25)
)
MERGED = "m0: &m0 {k: 1}\n" + "".join(
    f"m{n}: &m{n} {{<<: [*m{n - 1}, *m{n - 1}]}}\n" for n in range(1, 25)
)


@pytest.mark.parametrize(
    ("text", "variable"),
    [
        (ALIASES, "ELASTOCAL_MAX_YAML_VALUES"),
        (MERGED, "ELASTOCAL_MAX_YAML_VALUES"),
        ("me: &me [*me]\n", "ELASTOCAL_MAX_YAML_VALUES"),
        ("".join(f"key_{n}: 1\n" for n in range(60_000)), "ELASTOCAL_MAX_YAML_VALUES"),
        ("#" * 1_100_000 + "\na: 1\n", "ELASTOCAL_MAX_YAML_KB"),
        ("a: " + "[" * 70 + "]" * 70, "ELASTOCAL_MAX_NESTING"),
    ],
)
def test_a_small_file_cannot_ask_for_everything_and_the_refusal_says_what_raises_the_bound(
    tmp_path, text, variable
):
    path = tmp_path / "cell.yaml"
    path.write_text(text)
    with pytest.raises(SchemaError, match=variable):
        read_yaml(path, Cell, SCHEMA)


def test_a_variable_raises_a_bound_and_must_be_a_number(tmp_path, monkeypatch):
    path = tmp_path / "deep.json"
    path.write_text("[" * 70 + "]" * 70)
    monkeypatch.setenv("ELASTOCAL_MAX_NESTING", "80")
    assert read_json_data(path)[0]
    monkeypatch.setenv("ELASTOCAL_MAX_NESTING", "-1")
    with pytest.raises(FileAccessError, match="ELASTOCAL_MAX_NESTING is '-1'"):
        read_json_data(path)


def test_aliases_are_read(tmp_path):
    path = tmp_path / "cell.yaml"
    path.write_text(f"schema: {SCHEMA}\nrobot: &r arm\nstations: [{{name: *r}}]\n")
    assert read_yaml(path, Cell, SCHEMA).stations[0].name == "arm"


@pytest.mark.parametrize("written", [r"\ud800", r"\U0000dfff"])
def test_half_of_a_letter_is_refused(tmp_path, written):
    path = tmp_path / "cell.yaml"
    path.write_text(f'schema: elastocal.cell/1\nrobot: "{written}"\n')
    with pytest.raises(SchemaError, match=r"cell\.yaml: it holds .*, half of a letter$"):
        read_yaml(path, Cell, "elastocal.cell/1")
