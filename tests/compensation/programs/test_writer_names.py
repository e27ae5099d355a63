"""What KRL allows in names and comments."""

import pytest

from elastocal.compensation.programs.krl_writer import KrlWriter
from elastocal.errors import PlanningError
from elastocal.templating import plain


@pytest.mark.parametrize("name", ["calib", "_x", "Plan_2", 20 * "Z"])
def test_plain_names_pass(name):
    KrlWriter().check_name(name)


def test_a_taken_name_is_refused_in_either_case():
    with pytest.raises(PlanningError, match="'xHome' cannot name a KRL program"):
        KrlWriter().check_name("xHome", frozenset({"XHOME"}))


def test_a_reserved_word_inside_a_name_is_fine():
    KrlWriter().check_name("linear")


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("Höhe, Straße", "Hohe, Stra?e"),
        ("a\r\nPTP XHOME", "a PTP XHOME"),
        ("100 %{PE}", "100 ?{PE}"),
        ("bell\x07", "bell?"),
        ("", ""),
    ],
)
def test_a_comment_is_one_line_of_ascii(text, shown):
    assert plain(text) == shown


def test_a_comment_is_cut_short():
    assert len(plain(1000 * "x")) == 80
