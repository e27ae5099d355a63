"""Every fault of every device in every phase of a press, over sockets: nothing pushes.

What is judged is the simulated cell's own force and height; see `support.fault_matrix`. The table
of the documentation is held here too.
"""

import json
from pathlib import Path

import pytest

from support.fault_matrix import (
    FAULTS,
    PHASES,
    STAYS,
    Outcome,
    broken,
    complaints,
    quick_cell,
)

DOCS = Path(__file__).parents[2] / "docs"
WALKED = DOCS / "hooks" / "gallery" / "fault_matrix.json"
FIRST = [("PC: killed", "lateral load")]
"""Those that run in `make test`, some 10 s of processor each; every night all of them."""


def matrix() -> list:
    return [
        pytest.param(fault, phase, marks=[] if (fault, phase) in FIRST else [pytest.mark.slow])
        for fault in FAULTS
        for phase in PHASES
    ]


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    return quick_cell(tmp_path_factory.mktemp("matrix"))


@pytest.mark.end_to_end
@pytest.mark.parametrize(("fault", "phase"), matrix())
def test_a_fault_lets_go_or_says_why_not_and_the_run_goes_on(planned, tmp_path, fault, phase):
    outcome = broken(planned, tmp_path / "run", fault, phase)
    assert complaints(outcome) == [], outcome


def walked() -> list[Outcome]:
    return [Outcome(**row) for row in json.loads(WALKED.read_text(encoding="utf-8"))]


def test_the_table_of_the_documentation_has_every_cell_within_its_limits():
    found = walked()
    cells = {(each.fault, each.phase) for each in found}
    assert len(cells) == len(found)
    assert cells == {(fault, phase) for fault in FAULTS for phase in PHASES}
    assert [(each, why) for each in found if (why := complaints(each))] == []


def test_the_page_says_why_a_tool_stays_and_what_a_person_does():
    page = (DOCS / "how-to" / "what-a-fault-does.md").read_text(encoding="utf-8")
    held = {each.fault for each in walked() if each.released is None}
    assert held <= STAYS.keys() <= FAULTS.keys()
    assert all(f"| {fault} | {why} |" in page for fault, why in STAYS.items())


def test_a_push_a_lie_and_a_late_word_are_complained_of():
    good = Outcome("force: silent", "press", "silent", 200.0, 0.0, 0.3, 0.3, 0.0, True)
    assert complaints(good) == []
    for wrong in (
        {"added": 200.0}, {"again": 1e-3}, {"pushed": 1e-3}, {"lost": 1}, {"truthful": False},
        {"said": 2.0}, {"released": None}, {"resumed": "arm stopped"},
    ):  # fmt: skip
        assert len(complaints(Outcome(**(vars(good) | {"pushed": 0.0} | wrong)))) == 1
