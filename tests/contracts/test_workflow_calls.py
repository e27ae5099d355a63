"""Every workflow from Python: files as texts, options by name, and a signature that shows them."""

import dataclasses
import inspect
import re
import typing
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

import elastocal as ec
from elastocal import workflows
from elastocal.elastic import ElasticModel, layout
from elastocal.progress import silent
from elastocal.workflows._workflow import _as_hinted, workflow
from support import cells, reported

READINGS = ec.datasets.fanuc_r2000ic()

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


def _needed(work: Callable[..., object]) -> list[str]:
    """Return the names of what a workflow cannot do without."""
    parameters = inspect.signature(work).parameters.values()
    return [each.name for each in parameters if each.default is each.empty]


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
        given = _as_hinted(name, settings, required | texts)
        for each, text in texts.items():
            wanted = tuple(map(Path, text)) if isinstance(text, tuple) else Path(text)
            assert given[each] == wanted, each

    def test_a_value_of_another_type_is_refused_by_the_name_of_its_option(self, name):
        work = getattr(workflows, name)
        given = dict.fromkeys(_needed(work), "a")
        for field, hint in typing.get_type_hints(NAMES[name]).items():
            if getattr(hint, "_is_protocol", False):
                continue
            refusal = rf"^{name}\(\): {field} is of type object \(allowed: [^\n]+\)$"
            with pytest.raises(TypeError, match=refusal):
                work(**given | {field: object()})

    @pytest.mark.parametrize("wrong", [3, 2.5, None, object(), [3]])
    def test_what_it_starts_from_is_no_number(self, name, wrong, monkeypatch, tmp_path):
        monkeypatch.chdir(tmp_path)
        work = getattr(workflows, name)
        with pytest.raises(TypeError, match=rf"^{name}\(\): \w+ is [^\n]*\(allowed: [^\n]+\)$"):
            work(*([wrong] * max(1, len(_needed(work)))))
        assert not [*tmp_path.iterdir()]


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


@dataclasses.dataclass(frozen=True)
class _Kinds:
    source: Path
    point: tuple[float, float, float] | None = None
    word: Literal["a", "b"] = "a"
    switch: bool = False
    text: str | None = None
    columns: Mapping[str, float] = dataclasses.field(default_factory=dict)


@workflow(_Kinds)
def _kinds(settings, progress):
    """Return the settings that arrive."""
    return settings


@pytest.mark.parametrize(
    ("field", "wrong", "words"),
    [
        ("source", 3, "3, of type int (allowed: path)"),
        ("point", "60 mm, 0 mm", "'60 mm, 0 mm', of type str (allowed: 3 numbers, None)"),
        ("point", (1.0, 2.0), "of type tuple (allowed: 3 numbers, None)"),
        ("point", (1.0, 2.0, "3 m"), "'3 m', of type str (allowed: 3 numbers, None)"),
        ("word", 3, "3, of type int (allowed: a, b)"),
        ("switch", "no", "'no', of type str (allowed: True or False)"),
        ("text", 3, "3, of type int (allowed: text, None)"),
        ("columns", [3], "of type list (allowed: columns or values by name)"),
    ],
)
def test_a_refusal_says_what_was_given_and_what_is_allowed(field, wrong, words):
    with pytest.raises(TypeError) as refused:
        _kinds(**{"source": "a", field: wrong})
    assert str(refused.value) == f"_kinds(): {field} is {words}"


def test_numbers_of_numpy_are_numbers():
    taken = _kinds("a", point=np.array([1, 2, 3]), switch=np.bool_(True), text=Path("b"))
    assert taken == _kinds(_Kinds(Path("a")), point=(1, 2, 3), switch=True, text="b")


def test_what_follows_the_fields_must_be_callable():
    with pytest.raises(TypeError, match=r"_echo\(\) takes one argument without a name"):
        _echo("a", 3)


WRONG = {
    "read_dataset": (lambda: ec.read_dataset(READINGS), "path is of type Dataset (allowed: path)"),
    "read_model": (lambda: ec.read_model(3), "source is 3, of type int (allowed: path, Cal"),
    "read_plan": (lambda: ec.read_plan(3), "folder is 3, of type int (allowed: path)"),
    "load_cell": (lambda: ec.load_cell(3), "path is 3, of type int (allowed: path)"),
    "a robot's text": (lambda: ec.Robot.from_urdf(Path("a.urdf"), "tcp"), "text is of type"),
    "a robot's file": (lambda: ec.Robot.from_file(3, "tcp"), "path is 3, of type int (allowed: p"),
    "robot": (lambda: ElasticModel("a.urdf", ()), "robot is 'a.urdf', of type str (allowed: R"),
    "springs": (lambda: ElasticModel(cells.robot(), "bearing"), "springs is 'bearing', of type"),
    "a spring": (lambda: ElasticModel(cells.robot(), [3]), "springs is 3, of type int (allowed:"),
    "layout of": (lambda: layout("x.urdf", "bearing"), "robot is 'x.urdf', of type str (allowed"),
    "layout": (lambda: layout(cells.robot(), 3), "name is 3, of type int (allowed: path, name"),
}
"""Calls of other public functions with a wrong type, and how the refusal begins."""


@pytest.mark.parametrize("name", WRONG)
def test_other_public_functions_name_the_argument_of_a_wrong_type(name):
    call, words = WRONG[name]
    with pytest.raises(TypeError) as refused:
        call()
    assert str(refused.value).startswith(words)
    assert "\n" not in str(refused.value)


def test_the_name_of_a_file_is_no_text_of_a_robot():
    with pytest.raises(ec.errors.RobotError, match=r"not 'file\.urdf' \(Robot\.from_file"):
        ec.Robot.from_urdf("file.urdf", "tcp")


def test_loads_and_postures_of_other_rows_are_refused_with_both():
    robot = cells.robot()
    model, q = ElasticModel(robot, layout(robot, "actuated")), [[0.0] * len(robot.joint_names)] * 2
    with pytest.raises(
        ec.errors.SpringError, match=r"force of shape \(3, 3\) and .* of \(2,\) rows"
    ):
        model.observation_blocks(q, [[1.0, 0.0, 0.0]] * 3)
    with pytest.raises(ec.errors.SpringError, match=r"moment of shape \(3, 3\) and"):
        model.observation_blocks(q, [1.0, 0.0, 0.0], [[1.0, 0.0, 0.0]] * 3)
