import enum
import json
import tracemalloc

import numpy as np
import pytest

from elastocal.arrays import BoolArray, FloatArray
from elastocal.errors import SchemaError
from elastocal.records import from_data, read_json, record, to_data, write_json


class Light(enum.Enum):
    GREEN = "green"
    RED = "red"


@record()
class Part:
    name: str
    weight: float
    light: Light = Light.GREEN


@record("elastocal.inner/3")
class Inner:
    values: tuple[int, ...]


@record("elastocal.whole/2", eq=False)
class Whole:
    title: str
    parts: tuple[Part, ...]
    draws: FloatArray
    seen: BoolArray
    inner: Inner | None = None


def whole() -> Whole:
    draws, seen = np.array([[1.5, -2e-9], [0.0, 3.0]]), np.array([True, False])
    return Whole("a", (Part("p", 0.1, Light.RED),), draws, seen, Inner((1, 2)))


def test_the_schema_stands_first_and_parts_have_none():
    data = to_data(whole())
    assert list(data)[:2] == ["schema", "title"]
    assert data["inner"] == {"schema": "elastocal.inner/3", "values": [1, 2]}
    assert data["parts"] == [{"name": "p", "weight": 0.1, "light": "red"}]
    json.dumps(data, allow_nan=False)


def test_a_file_gives_the_same_class_back(tmp_path):
    write_json(tmp_path / "whole.json", whole())
    found = read_json(tmp_path / "whole.json", Whole)
    assert type(found) is Whole
    assert found.parts == whole().parts
    assert found.inner == whole().inner
    np.testing.assert_array_equal(found.draws, whole().draws)
    assert found.draws.dtype == np.float64
    assert found.seen.dtype == np.bool_
    assert not found.draws.flags.writeable


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"schema": "elastocal.whole/9"}, "'elastocal.whole/9'; this version reads"),
        ({"inner": {"schema": "elastocal.inner/4", "values": []}}, "f.json: inner has schema"),
        ({"titel": "b"}, "unknown key 'titel'; did you mean 'title'?"),
        ({"parts": [{"name": "p", "weigth": 1.0}]}, "'parts.0.weigth'; did you mean 'weight'"),
        ({"parts": [{"name": "p", "weight": True}]}, "parts.0.weight: Input should be a valid num"),
        ({"parts": [{"name": "p", "weight": "1"}]}, "parts.0.weight: Input should be a valid num"),
        ({"parts": [{"name": "p", "weight": float("nan")}]}, "parts.0.weight"),
        ({"parts": [{"name": "p", "weight": 1, "light": "blue"}]}, "'green' or 'red', got 'blue'"),
        ({"draws": [[1.0], [2.0, 3.0]]}, "draws: rows must have one length"),
        ({"draws": [["x"]]}, "draws.0.0: must be a finite number, got 'x'"),
        ({"draws": [None]}, "draws.0: must be a finite number, got None"),
        ({"draws": [[1.0, float("inf")]]}, "draws.0.1: must be a finite number, got inf"),
        ({"seen": [1, 0]}, "seen.0: must be true or false, got 1"),
    ],
)
def test_what_does_not_fit_is_refused_in_one_line(change, words):
    with pytest.raises(SchemaError) as refused:
        from_data(Whole, to_data(whole()) | change, "f.json")
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)
    assert str(refused.value).startswith("f.json")


def test_a_long_text_among_numbers_takes_no_more_room_than_it_has():
    draws = [[1.0] * 50 for _ in range(50)]
    draws[20][30] = "x" * 10_000
    tracemalloc.start()
    with pytest.raises(SchemaError, match=r"draws\.20\.30: must be a finite number"):
        from_data(Whole, to_data(whole()) | {"draws": draws}, "f.json")
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 10e6


def test_a_missing_key_is_named():
    data = to_data(whole())
    del data["draws"]
    with pytest.raises(SchemaError, match="key 'draws' is missing"):
        from_data(Whole, data, "f.json")


def test_a_whole_number_is_a_number():
    assert from_data(Part, {"name": "p", "weight": 1}, "f.json").weight == 1.0
