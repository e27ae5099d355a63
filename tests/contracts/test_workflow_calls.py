"""Every workflow from Python: files as texts, options by name, and a signature that shows them."""

import dataclasses
import inspect
import re
import typing
from pathlib import Path

import pytest

import elastocal as ec
from elastocal import workflows
from elastocal.progress import silent
from elastocal.workflows._workflow import _as_hinted, workflow
from support import reported

NAMES = {
    name: settings
    for name in workflows.__all__
    if (settings := getattr(workflows, f"{name.title().replace('_', '')}Settings", None))
} | {"dry_run": workflows.RunSettings}


def _paths(settings: type) -> dict[str, object]:
    """Return the hints of the fields that hold paths and take no text by themselves."""
    hints = typing.get_type_hints(settings)
    return {
        each.name: hints[each.name]
        for each in dataclasses.fields(settings)
        if "Path" in str(hints[each.name]).replace("PathLike", "")
    }


def test_every_workflow_is_looked_at():
    assert len(NAMES) >= 17


def _kind(hint: object) -> str:
    """Return what a field takes: a path, a text, a number, or the class that it names."""
    text = str(hint)
    if "Path" in text:
        return "path"
    for kind in ("str", "bool", "float", "int"):
        if re.search(rf"\b{kind}\b", text):
            return kind
    return text


def test_a_name_has_one_meaning_in_all_settings():
    kinds: dict[str, set[str]] = {}
    for settings in NAMES.values():
        for name, hint in typing.get_type_hints(settings).items():
            kinds.setdefault(name, set()).add(_kind(hint))
    assert {name: found for name, found in kinds.items() if len(found) > 1} == {}


def test_what_is_written_goes_to_out():
    # `check`, `release`, `verify` and `watch` write nothing, `derive` into its run, `studio` edits.
    writing = NAMES.keys() - {"check", "derive", "release", "studio", "verify", "watch"}
    assert [
        name for name in writing if "out" not in inspect.signature(NAMES[name]).parameters
    ] == []


@pytest.mark.parametrize("name", NAMES)
class TestEveryWorkflow:
    def test_its_signature_shows_the_fields_of_its_settings(self, name):
        shown = inspect.signature(getattr(workflows, name)).parameters
        fields = {each.name for each in dataclasses.fields(NAMES[name])}
        assert set(shown) == fields | {"progress"}
        assert shown["progress"].default is silent

    def test_an_unknown_option_is_refused_with_the_nearest(self, name):
        first, *rest = inspect.signature(NAMES[name]).parameters
        near = (rest or [first])[0]
        with pytest.raises(TypeError, match=rf"has no option '{near}x'; did you mean '{near}'\?"):
            getattr(workflows, name)("x", **{f"{near}x": 1})

    def test_a_path_may_be_a_text(self, name):
        settings = NAMES[name]
        texts = {
            each: ("a", "b") if "tuple" in str(hint) else "a"
            for each, hint in _paths(settings).items()
        }
        required = {
            each.name: "a"
            for each in inspect.signature(settings).parameters.values()
            if each.default is each.empty
        }
        given = _as_hinted(settings(**required | texts))
        for each, text in texts.items():
            wanted = tuple(map(Path, text)) if isinstance(text, tuple) else Path(text)
            assert getattr(given, each) == wanted, each


@pytest.mark.slow
def test_paths_given_as_texts_are_read_and_written(tmp_path_factory):
    done = reported.finished()
    out = tmp_path_factory.mktemp("texts")
    model, data = str(done / "model.json"), str(done / "run" / "dataset.nc")
    rows, again = str(done / "process" / "path.csv"), str(out / "again.json")
    ec.calibrate(data=data, springs="actuated", draws=40, seed=7, out=again)
    ec.predict(model, rows=rows, out=str(out / "predicted.csv"))
    ec.tool(str(done / "run"), out=str(out / "tool.json"))
    ec.compensate(model, path=rows, out=str(out / "corrected.csv"))
    figure = str(out / "compared.svg")
    ec.compare(model, new=again, rows=rows, out=str(out / "compared.json"), figure=figure)
    ec.export(model, out=str(out / "c"))
    ec.stiffness(model, path=rows, out=str(out / "s"), spins=2, external_positions=2, stations=2)
    assert {each.name for each in out.iterdir()} == {
        *("again.json", "predicted.csv", "tool.json", "corrected.csv", "compared.json"),
        *("compared.svg", "c", "s"),
    }


@dataclasses.dataclass(frozen=True)
class _Settings:
    source: str
    names: tuple[str, ...] = ()
    number: int = 0


@workflow(_Settings)
def _echo(settings, progress):
    """Return the settings that arrive."""
    progress("echo", 1, 1)
    return settings


def test_one_name_is_not_split_into_letters():
    assert _echo("a", names="12").names == ("12",)
    assert _echo(_Settings("a", names="12")).names == ("12",)
    assert _echo("a", names=["1", "2"]).names == ("1", "2")


def test_what_it_starts_from_may_be_named_and_must_be_given():
    assert _echo(source="a", number=3) == _Settings("a", number=3)
    with pytest.raises(TypeError, match=r"_echo\(\) needs 'source'"):
        _echo(number=3)
    with pytest.raises(TypeError, match="one argument without a name"):
        _echo("a", silent, 3)


def test_settings_take_changes_and_progress_is_called():
    heard = []
    assert _echo(_Settings("a"), lambda *each: heard.append(each), number=2).number == 2
    assert heard == [("echo", 1, 1)]
