"""`elastocal demo`: the whole story, and what can go wrong before it."""

import importlib
import json
import re
import shlex
from pathlib import Path

import pytest

from elastocal.cli.commands import COMMANDS
from elastocal.errors import FileAccessError
from elastocal.units import with_fixed_units
from elastocal.workflows import Chapter, InitResult
from elastocal.workflows.demo import README, begin, chapters
from support.cli import elastocal
from support.demos import demo_result, finished_demo


def test_a_demo_says_what_it_does_and_what_came_of_it():
    told = demo_result("afp").err
    folder = finished_demo("afp")
    for chapter in chapters("afp", folder, 0):
        assert chapter.line in told
    table = json.loads((folder / "process/table.json").read_text())
    (line,) = table["lines"]
    assert f"-{100 * line['reduction']['mean']:.1f}%" in told
    assert str(folder / "report.html") in told


def test_every_file_that_the_demos_readme_names_is_there():
    folder = finished_demo("afp")
    text = (folder / README).read_text(encoding="utf-8")
    named = re.findall(r"\]\(([^)]+)\)", text)
    assert len(named) > 10
    assert not [name for name in named if not (folder / name).exists()]
    top = {path.name for path in folder.iterdir()}
    assert top <= {name.split("/")[0] for name in named} | {README, "dome.stl"}


def test_the_log_of_a_demo_holds_every_command_with_its_output():
    log = (finished_demo("afp") / "log.txt").read_text(encoding="utf-8")
    commands = re.findall(r"^\$ elastocal (\S+)", log, flags=re.MULTILINE)
    assert commands == [c.words[0] for c in chapters("afp", Path("demo"), 0)]
    assert "written to" in log
    # The low level of the example tells friction from compliance.
    assert re.search(r"^gears\+fine-friction .* taken", log, flags=re.MULTILINE)


def test_the_light_of_the_demo_is_yellow_for_the_reason_that_the_page_gives():
    page = (Path(__file__).parents[2] / "docs/how-to/read-the-report.md").read_text("utf-8")
    (reason,) = re.findall(r'ends with a yellow light: "([^"]+)"', page)
    found = (finished_demo("afp") / "report.html").read_text(encoding="utf-8")
    assert "yellow light" in found
    assert with_fixed_units(reason) in found


def test_a_demo_on_the_typical_truth_takes_out_most_of_the_deviation():
    table = json.loads((finished_demo("afp") / "process/table.json").read_text())
    reduction = table["lines"][-1]["reduction"]
    # On the truth `typical`, measured where production runs; the paper has 0.89 and 0.70.
    assert reduction["mean"] >= 0.87
    assert reduction["max"] >= 0.80
    assert table["lines"][-1]["after"]["max"] <= 0.15e-3


@pytest.mark.slow
def test_the_machining_demo_takes_out_four_fifths_of_the_deviation():
    """On the truth `typical`; the page on processes has it over seeds, beside the paper's."""
    table = json.loads((finished_demo("machining") / "process/table.json").read_text())
    reduction = table["lines"][-1]["reduction"]
    assert reduction["mean"] >= 0.80
    assert reduction["max"] >= 0.65


@pytest.mark.slow
def test_the_page_on_postures_quotes_the_machining_demo():
    table = json.loads((finished_demo("machining") / "process/table.json").read_text())
    page = Path(__file__).parents[2] / "docs/how-to/choose-a-posture.md"
    quoted = re.findall(r"^\| .* \| ([\d.]+) → ([\d.]+) \| ([\d.]+) → ([\d.]+) \|$",
                        page.read_text(encoding="utf-8"), flags=re.MULTILINE)  # fmt: skip
    for lines, shown in zip((table["posture"]["lines"], table["lines"]), quoted, strict=True):
        before, after = lines[-1]["before"], lines[-1]["after"]
        found = [each[part] for part in ("mean", "max") for each in (before, after)]
        assert [float(each) for each in shown] == pytest.approx(
            [1e3 * each for each in found], abs=0.002
        )


@pytest.mark.slow
def test_the_machining_demo_is_yellow_for_the_one_reason_that_the_page_gives():
    page = (Path(__file__).parents[2] / "docs/how-to/read-the-report.md").read_text("utf-8")
    (reason,) = re.findall(r'within its 0.5 mm and yellow too: "([^"]+)"', page)
    found = (finished_demo("machining") / "report.html").read_text(encoding="utf-8")
    assert "Within, with open points" in found
    assert with_fixed_units(reason) in found
    assert with_fixed_units("wrong by more than 0.500 mm") not in found


@pytest.mark.parametrize("kind", ["afp", "machining"])
def test_every_chapter_is_a_public_command(kind, tmp_path):
    for chapter in chapters(kind, tmp_path, 3):
        assert chapter.words[0] in COMMANDS
        assert shlex.split(chapter.line)[1:] == list(chapter.words)


def test_an_unknown_demo_is_refused_by_name(tmp_path):
    reason = elastocal("demo", "machning", "--out", tmp_path / "demo").reason
    assert "'machning'" in reason
    assert "machining" in reason
    assert not (tmp_path / "demo").exists()


def test_a_folder_of_ones_own_is_never_emptied(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    for more in ((), ("--force",)):
        assert "thesis.tex" in elastocal("demo", "--out", tmp_path, *more).reason
    assert (tmp_path / "thesis.tex").read_text() == "years of work"


def test_a_folder_with_somebody_elses_readme_is_never_emptied(tmp_path):
    (tmp_path / README).write_text("# My work")
    assert README in elastocal("demo", "--out", tmp_path, "--force").reason


def test_an_earlier_demo_is_removed_only_when_told(tmp_path):
    begin(tmp_path / "demo", "afp", force=False)
    (tmp_path / "demo" / "codec").mkdir()
    (tmp_path / "demo" / "codec" / "old.txt").write_text("")
    with pytest.raises(FileAccessError, match="holds a demo already"):
        begin(tmp_path / "demo", "afp", force=False)
    begin(tmp_path / "demo", "afp", force=True)
    assert [path.name for path in (tmp_path / "demo").iterdir()] == [README]


def test_what_somebody_put_into_a_demo_is_never_removed(tmp_path):
    begin(tmp_path, "afp", force=False)
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(FileAccessError, match=r"thesis\.tex"):
        begin(tmp_path, "afp", force=True)
    assert (tmp_path / "thesis.tex").read_text() == "years of work"


def test_an_empty_folder_and_a_link_to_one_are_taken(tmp_path):
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to("real")
    for force in (False, True):
        begin(tmp_path / "link", "afp", force)
    assert (tmp_path / "link").is_symlink()
    assert [path.name for path in (tmp_path / "real").iterdir()] == [README]


def test_a_link_in_a_demo_is_removed_without_what_it_leads_to(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("years of work")
    begin(tmp_path / "demo", "afp", force=False)
    (tmp_path / "demo" / "codec").symlink_to(tmp_path / "mine")
    begin(tmp_path / "demo", "afp", force=True)
    assert not (tmp_path / "demo" / "codec").exists()
    assert (tmp_path / "mine" / "thesis.tex").exists()


def test_a_file_in_the_place_of_the_folder_is_refused(tmp_path):
    (tmp_path / "demo").write_text("")
    assert str(tmp_path / "demo") in elastocal("demo", "--out", tmp_path / "demo").reason


STORY = importlib.import_module("elastocal.workflows.demo")  # its face has the function


def look(_show, _operator):
    return InitResult(Path("cell.yaml"), (), Path("process.csv"))


def test_a_chapter_that_fails_ends_the_demo_with_its_reason(tmp_path, monkeypatch):
    def fail(_show, _operator):
        raise FileAccessError("cannot read none.yaml")

    story = (
        Chapter("look", ("init",), look),
        Chapter("fail", ("check", "none.yaml"), fail),
        Chapter("never", ("init",), look),
    )
    monkeypatch.setattr(STORY, "chapters", lambda *_: story)
    result = elastocal("demo", "--out", tmp_path / "demo")
    assert result.code == 1
    assert result.err.splitlines()[-1].startswith("elastocal: cannot read")
    assert "never" not in result.err
    assert "Not finished" in (tmp_path / "demo" / README).read_text()


def test_a_chapter_that_is_interrupted_ends_the_demo_with_its_code(tmp_path, monkeypatch):
    def interrupt(_show, _operator):
        raise KeyboardInterrupt

    story = (Chapter("look", ("init",), interrupt), Chapter("never", ("init",), look))
    monkeypatch.setattr(STORY, "chapters", lambda *_: story)
    result = elastocal("demo", "--out", tmp_path / "demo")
    assert result.code == 130
    assert "never" not in result.err
