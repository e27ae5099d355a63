import json

import numpy as np
import pytest

from elastocal.errors import SchemaError
from elastocal.identification.recertification import CompareSummary, recertify
from elastocal.records import read_json, write_json
from support.problems import campaign
from support.recertified import made_up

LOADS = campaign().joint_position[:5], campaign().force[:5]


def found(*rows, **options):
    softer = 1e-6 * np.array([1.0, 1.0, 1.3, 1.0, 1.0, 1.0])
    return recertify(made_up(0), made_up(1, compliance=softer), *rows, **options)


def test_a_file_holds_what_the_comparison_says(tmp_path):
    comparison = found(*LOADS, 10.0 * np.ones((5, 3)), limit=1e-5)
    write_json(tmp_path / "c.json", comparison.summary)
    again = read_json(tmp_path / "c.json", CompareSummary)
    assert again == comparison.summary
    assert again.moved == ("joint_3.axial",)
    assert again.verdict == "fail"
    assert again.deflection.where.row == comparison.rows.where
    assert again.deflection.where.moment == (10.0, 10.0, 10.0)
    np.testing.assert_array_equal(again.deflection.size, comparison.rows.size)
    assert [each.together.low for each in again.springs] == [
        each.together.low for each in comparison.summary.springs
    ]


def test_what_was_not_asked_is_null(tmp_path):
    write_json(tmp_path / "c.json", found().summary)
    data = json.loads((tmp_path / "c.json").read_text())
    assert data["schema"] == "elastocal.comparison/1"
    assert data["deflection"] is data["limit"] is data["verdict"] is None


@pytest.mark.parametrize(
    ("key", "value"),
    [("schema", "elastocal.comparison/2"), ("verdict", "maybe"), ("robot", None), ("extra", 1)],
)
def test_a_file_that_is_no_comparison_is_refused_by_key(tmp_path, key, value):
    path = tmp_path / "c.json"
    write_json(path, found().summary)
    path.write_text(json.dumps(json.loads(path.read_text()) | {key: value}))
    with pytest.raises(SchemaError, match=key):
        read_json(path, CompareSummary)
