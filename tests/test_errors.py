import inspect

import pytest

from elastocal import errors
from elastocal.errors import ElastocalError, InternalError, nearest, of_kind, present

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


def test_what_elastocal_makes_sure_of_is_an_error_where_it_is_not_so():
    assert present(0.0, "force") == 0.0
    assert of_kind(True, int, "count") is True
    with pytest.raises(InternalError, match=r"^force: missing, which is a mistake in elastocal"):
        present(None, "force")
    with pytest.raises(InternalError, match=r"^count is a str, not a int, which is a mistake"):
        of_kind("1", int, "count")
