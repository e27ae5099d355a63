"""Contract of every writer of robot programs that needs no reader of its language."""

from dataclasses import replace
from pathlib import Path

import pytest

from elastocal.compensation.programs import PROGRAM_WRITERS, ProgramWriter, write_plan_program
from elastocal.errors import PlanningError
from elastocal.planning import PlanResult


class ProgramSuite:
    """Tests of a writer, the fixture ``writer``, by a ``plan`` for a robot that it takes."""

    def test_it_is_found_by_its_language(self, writer: ProgramWriter) -> None:
        assert PROGRAM_WRITERS.named(writer.language) is writer

    def test_it_writes_a_file_for_each_suffix(
        self, writer: ProgramWriter, plan: PlanResult, tmp_path: Path
    ) -> None:
        files = write_plan_program(tmp_path, plan, writer)
        assert [each.suffix for each in files] == list(writer.suffixes)
        assert all(each.read_bytes() for each in files)

    @pytest.mark.parametrize(
        "name", ["", "2nd", "a b", "naïve", "a.b", "../x", "$x", "a" * 40, "CON"]
    )
    def test_a_name_that_the_controller_does_not_allow_is_refused(
        self, writer: ProgramWriter, plan: PlanResult, tmp_path: Path, name: str
    ) -> None:
        with pytest.raises(PlanningError, match=f"cannot name a {writer.title} program"):
            write_plan_program(tmp_path, plan, writer, name)
        assert not list(tmp_path.iterdir())

    def test_the_program_is_the_same_again(
        self, writer: ProgramWriter, plan: PlanResult, tmp_path: Path
    ) -> None:
        texts = []
        for folder in (tmp_path / "a", tmp_path / "b"):
            folder.mkdir()
            texts.append([each.read_bytes() for each in write_plan_program(folder, plan, writer)])
        assert texts[0] == texts[1]

    def test_no_name_of_people_begins_a_line(
        self, writer: ProgramWriter, plan: PlanResult, tmp_path: Path
    ) -> None:
        evil = "Zelle\r\nEVIL WORDS\u2028EVIL WORDS\x0bEVIL WORDS"
        changed = replace(plan, cell=replace(plan.cell, name=evil))
        for file in write_plan_program(tmp_path, changed, writer):
            lines = file.read_text("utf-8").splitlines()
            assert not [each for each in lines if each.lstrip().startswith("EVIL")]
