"""No command writes over an input, over somebody's file, or into the record of a run."""

import inspect
import os
import typing
from dataclasses import dataclass
from pathlib import Path

import pytest
from typer.models import ArgumentInfo

from elastocal.cli.commands import COMMANDS
from elastocal.cli.generator import Command
from elastocal.errors import FileAccessError
from elastocal.files import filling, read_text, write_text
from elastocal.outputs import RUN_RECORD, OutputRule, ruled
from elastocal.procedure import JOURNAL, RunFolder
from support.cli import elastocal

WRITTEN = {"out", "c", "figure", "picture", "ports", "report", "table", "urdf"}
"""Parameters that name what is written; every other path is an input."""
EITHER = {"robot", "springs"}
"""Parameters that take the name of something, or a file."""


@dataclass(frozen=True)
class Place:
    """A parameter of a command that names a file or folder."""

    name: str
    option: str
    """Empty for an argument."""
    required: bool


def _places(command: Command) -> list[Place]:
    signature = inspect.signature(command.callback())
    found = []
    for each in signature.parameters.values():
        kind, note = typing.get_args(each.annotation)
        flag = "" if isinstance(note, ArgumentInfo) else (note.param_decls or (note.default,))[0]
        # What an argument names is made where nothing is: `init`.
        name = flag.lstrip("-") or each.name.replace("out", "folder")
        if "Path" in str(kind) or name in EITHER:
            found.append(Place(name, flag, each.default is each.empty))
    return found


PLACES = {name: _places(command) for name, command in COMMANDS.items()}
PAIRS = [
    (name, source.name, target.name)
    for name, places in PLACES.items()
    for source in places
    for target in places
    if source.name not in WRITTEN
    and target.name in WRITTEN
    # The cell is for --guess, which has no other output than the map.
    and (name, source.name) != ("import", "cell")
]
WRITING = [name for name, places in PLACES.items() if "out" in [each.name for each in places]]


def _words(name: str, **given: Path) -> list[object]:
    """Return a command with some of its places, and ``--force``; others are not there."""
    words: list[object] = [name]
    for each in PLACES[name]:
        needed = each.required or each.name == "out"
        place = given.get(each.name, Path(f"no_{each.name}.json") if needed else None)
        if place is not None:
            words += [*filter(None, [each.option]), place]
    return words


def _forced(name: str) -> list[str]:
    return ["--force"] if "force" in inspect.signature(COMMANDS[name].callback()).parameters else []


def _linked(path: Path) -> Path:
    link = path.with_name("link.json")
    link.symlink_to(path.name)
    return link


def _hard_linked(path: Path) -> Path:
    link = path.with_name("hard.json")
    os.link(path, link)
    return link


SAME = {
    "itself": lambda path: path,
    "by another way": lambda path: path.parent / ".." / path.parent.name / path.name,
    "in capitals": lambda path: path.with_name(path.name.upper()),
    "link": _linked,
    "hard link": _hard_linked,
}


def test_every_command_that_writes_is_looked_at():
    silent = {"check", "release", "robots", "derive", "verify", "studio", "watch"}
    assert {name for name, *_ in PAIRS} == COMMANDS.keys() - silent - {"init", "demo"}


@pytest.mark.parametrize(("name", "source", "target"), PAIRS)
def test_an_input_is_never_an_output(tmp_path, name, source, target):
    place = tmp_path / "input.json"
    place.write_text("mine")
    words = _words(name, **{source: place, target: place})
    assert "is an input of this command" in elastocal(*words, *_forced(name)).reason
    assert place.read_text() == "mine"
    assert list(tmp_path.iterdir()) == [place]


@pytest.mark.parametrize("way", SAME)
def test_a_file_is_the_same_by_whatever_name(tmp_path, way):
    place = tmp_path / "input.json"
    place.write_text("mine")
    rule = OutputRule(force=True)
    rule.note_input(place)
    with pytest.raises(FileAccessError, match="input of this command"):
        rule.require(SAME[way](place))


@pytest.mark.parametrize(
    ("source", "target"),
    [("a.src", "A.DAT"), ("a.SRC", "a.src"), ("a.dat", "a.src"), ("a.nc", "a.csv")],
)
def test_files_that_are_one_thing_in_two_stand_for_one_another(tmp_path, source, target):
    (tmp_path / source).write_text("mine")
    rule = OutputRule(force=True)
    rule.note_input(tmp_path / source)
    with pytest.raises(FileAccessError, match="input of this command"):
        rule.require(tmp_path / target)


@pytest.mark.parametrize(
    ("name", "target"),
    [
        *((name, "out") for name in WRITING),
        ("compare", "figure"),
        ("import", "picture"),
    ],
)
def test_a_file_of_somebody_else_is_not_replaced(tmp_path, name, target):
    place = tmp_path / "notes.html"
    place.write_text("mine")
    assert str(place) in elastocal(*_words(name, **{target: place})).reason
    assert place.read_text() == "mine"


@pytest.mark.parametrize("name", [name for name in WRITING if name != "run"])
def test_nothing_is_written_into_the_record_of_a_run(tmp_path, name):
    (tmp_path / JOURNAL).write_text("{}\n")
    reason = elastocal(*_words(name, out=tmp_path / JOURNAL), *_forced(name)).reason
    assert "in the record of the run" in reason
    assert (tmp_path / JOURNAL).read_text() == "{}\n"


@pytest.mark.parametrize("part", RUN_RECORD)
def test_no_part_of_a_record_is_written_but_by_its_run(tmp_path, part):
    (tmp_path / JOURNAL).write_text("{}\n")
    place = tmp_path / part if "." in part else tmp_path / part / "new.html"
    with pytest.raises(FileAccessError, match="in the record of the run"):
        OutputRule(force=True).require(place)
    OutputRule(force=True, record=tmp_path).require(place)
    OutputRule(force=True).require(tmp_path / "model.json")


def test_the_record_of_a_run_is_what_its_folder_holds(tmp_path):
    run = RunFolder(tmp_path)
    places = (run.journal, run.cell, run.plan, run.streams, run.dataset, run.summary, run.signature)
    assert tuple(place.name for place in places) == RUN_RECORD


class TestWhatIsReadAndWritten:
    """Also files that no setting names: the meshes of a cell, the springs that a model includes."""

    def test_a_file_that_was_read_is_an_input(self, tmp_path):
        write_text(tmp_path / "a.json", "mine")
        with ruled(OutputRule(force=True)):
            read_text(tmp_path / "a.json")
            with pytest.raises(FileAccessError, match="it is an input of this command"):
                write_text(tmp_path / "A.json", "new")
        assert read_text(tmp_path / "a.json") == "mine"
        assert [each.name for each in tmp_path.iterdir()] == ["a.json"]

    def test_it_is_none_where_a_folder_is_filled(self, tmp_path):
        write_text(tmp_path / "path.csv", "mine")

        def fill():
            with filling(tmp_path, "table.json", force=True) as folder:
                read_text(tmp_path / "path.csv")
                write_text(folder / "path.csv", "new")
                write_text(folder / "table.json", "new")

        with ruled(OutputRule(force=True)), pytest.raises(FileAccessError, match="is an input"):
            fill()
        assert [(each.name, each.read_text()) for each in tmp_path.iterdir()] == [
            ("path.csv", "mine")
        ]

    def test_what_the_command_wrote_itself_may_be_read_and_replaced(self, tmp_path):
        with ruled(OutputRule()):
            write_text(tmp_path / "a.yaml", "first")
            read_text(tmp_path / "a.yaml")
            write_text(tmp_path / "a.yaml", "second")
        assert read_text(tmp_path / "a.yaml") == "second"

    def test_a_former_output_is_known_by_its_mark(self, tmp_path):
        write_text(tmp_path / "ours.json", '{"schema": "elastocal.model/1"}')
        write_text(tmp_path / "plan.json", '{"schema": "elastocal.plan/1"}')
        with ruled(OutputRule(marks=("elastocal.model/",))):
            write_text(tmp_path / "ours.json", "new")
            with pytest.raises(FileAccessError, match=r"no former output .* give --force"):
                write_text(tmp_path / "plan.json", "new")
        with ruled(OutputRule(force=True)):
            write_text(tmp_path / "plan.json", "new")

    def test_a_library_that_runs_no_command_writes_where_it_wants(self, tmp_path):
        write_text(tmp_path / "a.json", "old")
        read_text(tmp_path / "a.json")
        write_text(tmp_path / "a.json", "new")


@pytest.mark.parametrize("name", ["calibrate", "compare", "geometry", "predict", "simulate"])
@pytest.mark.parametrize("place", ["plain/out.json", "plain/further/out.json", "folder"])
def test_a_place_where_no_file_can_be_is_refused_before_the_work(tmp_path, name, place):
    """Inputs are not there either: were they read first, they would be what is refused."""
    (tmp_path / "plain").write_text("x")
    (tmp_path / "folder").mkdir()
    out = {each.name: each for each in PLACES[name]}.get("out", Place("ports", "--ports", False))
    words = [str(word) for word in _words(name)]
    words = [word for word in words if word != out.option and word != "no_out.json"]
    shown = elastocal(*words, out.option, tmp_path / place)
    assert shown.code == 1
    assert f"cannot write {tmp_path / place}: " in shown.reason


def test_links_that_lead_in_a_circle_are_refused_in_a_line(tmp_path):
    (tmp_path / "model.json").symlink_to("model.json")
    shown = elastocal("compare", tmp_path / "model.json", tmp_path / "model.json")
    assert "model.json: Too many levels of symbolic links" in shown.reason
