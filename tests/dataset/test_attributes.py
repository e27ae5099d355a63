import pytest

from elastocal.dataset import SCHEMA
from elastocal.dataset._layout import canonical_attributes
from elastocal.errors import DatasetError, SchemaError


def test_texts_that_are_not_known_are_empty_and_options_absent():
    assert canonical_attributes({"schema": SCHEMA}) == {
        "schema": SCHEMA,
        "robot_name": "",
        "provenance": "",
    }


def test_attributes_of_the_cf_conventions_are_carried_through():
    assert canonical_attributes({"schema": SCHEMA, "history": "cut"})["history"] == "cut"


@pytest.mark.parametrize(
    ("attributes", "message"),
    [
        (
            {},
            "dataset has no attribute 'schema'; this version reads 'elastocal.dataset/1' and"
            " 'elastocal.dataset/2'",
        ),
        (
            {"schema": "elastocal.dataset/3"},
            "dataset has schema 'elastocal.dataset/3'; this version reads 'elastocal.dataset/1'"
            " and 'elastocal.dataset/2'",
        ),
    ],
)
def test_an_unknown_schema_is_refused_by_name(attributes, message):
    with pytest.raises(SchemaError) as caught:
        canonical_attributes(attributes)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("attributes", "message"),
    [
        ({"robot_udrf": "x"}, "attribute 'robot_udrf' is not known; did you mean 'robot_urdf'?"),
        ({"provenance": 3}, "attribute 'provenance' is 3: it must be a text"),
        ({"provenance": "a\0b"}, r"attribute 'provenance' is 'a\x00b': it must be a text"),
        ({"provenance": "\ud800"}, r"attribute 'provenance' is '\ud800': it must be a text"),
        (
            {"gravity": "0 m/s2, 0 m/s2, -9.81"},
            "attribute 'gravity' is '0 m/s2, 0 m/s2, -9.81': it must be three accelerations, such"
            " as '0 m/s2, 0 m/s2, -9.81 m/s2'",
        ),
        ({"tcp_frame": ""}, "attribute 'tcp_frame' is empty: leave it out when it is not known"),
    ],
)
def test_a_bad_attribute_is_refused_by_name(attributes, message):
    with pytest.raises(DatasetError) as caught:
        canonical_attributes({"schema": SCHEMA} | attributes)
    assert str(caught.value).startswith(message)
