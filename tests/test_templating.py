"""What is put into the text of a program stays within its line; what a page is given is escaped."""

import pytest
from jinja2 import DictLoader, UndefinedError

from elastocal.errors import ReportError
from elastocal.templating import templates

HOSTILE = ["a\nPTP XHOME", "a\r$OUT[1]=TRUE", "a\x0bHALT", "a\u2028HALT", "a\x85HALT", "\x1b[2J"]


def rendered(monkeypatch, markup, text, **values):
    environment = templates("elastocal.compensation.programs", markup)
    monkeypatch.setattr(environment, "loader", DictLoader({"text": text}))
    environment.cache.clear()
    return environment.get_template("text").render(values)


@pytest.mark.parametrize("name", HOSTILE)
def test_a_name_cannot_begin_a_line_of_a_program(monkeypatch, name):
    with pytest.raises(ReportError, match="cannot stand in a program: give one line"):
        rendered(monkeypatch, False, "; cell {{ name }}", name=name)


@pytest.mark.parametrize("name", HOSTILE)
def test_a_name_made_plain_is_one_line(monkeypatch, name):
    assert len(rendered(monkeypatch, False, "; {{ name | plain }}", name=name).splitlines()) == 1


def test_a_program_keeps_every_sign_and_the_lines_of_its_macros(monkeypatch):
    text = "{% macro two() %}\nIF a<b\nENDIF\n{% endmacro %}{{ two() }}{{ name }} {{ 1.5 }}"
    assert rendered(monkeypatch, False, text, name="<&'\">") == "IF a<b\nENDIF\n<&'\"> 1.5"


def test_a_page_escapes_and_neither_takes_an_undefined_name(monkeypatch):
    assert rendered(monkeypatch, True, "{{ name }}", name="<b>") == "&lt;b&gt;"
    for markup in (True, False):
        with pytest.raises(UndefinedError):
            rendered(monkeypatch, markup, "{{ other }}")
