import inspect

import pytest

from elastocal import errors
from elastocal.errors import ElastocalError, nearest

CLASSES = [
    kind
    for _, kind in inspect.getmembers(errors, inspect.isclass)
    if kind.__module__ == errors.__name__
]


@pytest.mark.parametrize("kind", CLASSES)
def test_every_error_is_of_the_tree_and_a_builtin_that_a_caller_expects(kind):
    assert issubclass(kind, ElastocalError)
    assert kind is ElastocalError or issubclass(kind, ValueError | OSError | RuntimeError)
    assert inspect.getdoc(kind)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("bearing", "; did you mean 'bearing'?"),
        ("baering", "; did you mean 'bearing'?"),
        ("BEARING", "; did you mean 'bearing'?"),
        ("nothing like it", ""),
        ("", ""),
    ],
)
def test_nearest_names_only_what_is_near(name, expected):
    assert nearest(name, iter(["actuated", "bearing"])) == expected


def test_nearest_of_nothing_is_empty():
    assert nearest("bearing", []) == ""
