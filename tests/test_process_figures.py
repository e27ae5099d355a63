"""Pages and README quote the figures of simulated processes as they were measured."""

import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[1]
HOOKS = ROOT / "docs" / "hooks"


@pytest.fixture
def tables(monkeypatch) -> Iterator[ModuleType]:
    """Return the hook that fills the pages."""
    monkeypatch.syspath_prepend(str(HOOKS))
    import process_tables

    yield process_tables
    for name in [each for each in sys.modules if each.startswith(("process_tables", "gallery"))]:
        del sys.modules[name]


def quoted(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def test_the_readme_quotes_the_figures_of_the_typical_truth(tables):
    assert tables.summary() in quoted("README.md")
    assert "chance" in quoted("README.md")


def test_the_page_has_every_figure_that_was_measured(tables):
    page = tables.on_page_markdown(quoted("docs/how-to/simulate-a-process.md"), None)
    assert tables.summary() in page
    for each in tables.quoted():
        assert f"`{each['springs']}`" in page
    assert "<!-- process" not in page
    assert "nan" not in page


@pytest.mark.parametrize("kind", ["afp", "machining"])
def test_a_table_tells_its_seeds_and_stands_beside_the_paper(tables, kind):
    *rows, paper = tables.table(kind).split("\n\n")[0].splitlines()[2:]
    assert paper.startswith("| paper |")
    cells = [[cell.strip() for cell in row.split("|")[1:-1]] for row in rows]
    assert kind != "afp" or "typical" in {row[0] for row in cells}
    for row in cells:
        # An interval over several seeds; two values of two; none of a single one.
        assert (" to " in row[5]) == (int(row[-1]) > 2)
        assert (" and " in row[5]) == (int(row[-1]) == 2)


def test_short_campaigns_on_typical_are_no_worse_than_the_papers_way_and_take_8_minutes(tables):
    for kind in ("afp", "machining"):
        left = {}
        for each in tables.quoted():
            case = each["case"]
            if case["kind"] == kind and case["preset"] == "typical":
                lateral = each["deviations"][0]["mean"][1]
                left.setdefault((each["campaign"], each["springs"]), []).append(lateral)
                assert not each["campaign"].startswith("i_optimal") or each["minutes"] <= 8.0
        mean = {key: sum(values) / len(values) for key, values in left.items()}
        if not mean:
            continue
        short = min(mean["i_optimal 8", "auto"], mean["i_optimal 6", "auto"])
        assert short <= 1.1 * mean["cover 30", "bearing"]


def test_every_example_cell_stands_on_every_truth_with_all_seeds(tables):
    rows = [row.strip("| ").split(" | ") for row in tables.demos("all").splitlines()[2:]]
    measured = {(row[0], row[1]): row[-1] for row in rows if row[1] != "paper"}
    names = {demo.name for demo in tables.DEMOS.values()}
    assert measured == {(name, truth): "5" for name in names for truth in tables.TRUTHS}


@pytest.mark.parametrize("kind", ["afp", "machining"])
def test_campaigns_are_held_against_one_another_on_the_same_seeds(tables, kind):
    rows = tables.campaigns(kind).splitlines()[2:]
    assert {row.split("|")[1].strip() for row in rows} >= {"as `init` writes it", "`cover`"}
    assert len({row.strip("| ").split(" | ")[-1] for row in rows}) == 1


@pytest.mark.parametrize("kind", ["afp", "machining"])
def test_touches_before_production_are_held_against_springs_alone_on_the_same_seeds(tables, kind):
    rows = [row.strip("| ").split(" | ") for row in tables.touched(kind).splitlines()[2:]]
    typical = [row for row in rows if row[0] == "typical"]
    assert [row[1] for row in typical] == ["springs alone", "touched"]
    assert [row[-1] for row in typical] == ["5", "5"]
    alone, touched = (float(row[3].partition(" ")[0]) for row in typical)
    assert touched > alone
    assert float(typical[1][2]) < 5.0


@pytest.mark.parametrize("kind", ["afp", "machining"])
def test_every_procedure_states_its_time_and_what_it_brings_beside_springs_alone(tables, kind):
    lines = tables.procedures(kind).splitlines()[2:]
    rows = [[cell.strip() for cell in row.split("|")[1:-1]] for row in lines]
    assert {row[1] for row in rows} <= {"springs alone", *tables.MORE.values()}
    springs_alone = {}
    offset = {}
    for row in rows:
        if row[1] == "springs alone":
            springs_alone[row[0]] = row
            continue
        assert row[-1] == springs_alone[row[0]][-1]  # as many seeds
        assert "min" in row[2]
        assert ("course" in row[1]) == ("s a course" in row[2])
        if "offset" in row[1]:
            offset[row[0]] = (springs_alone[row[0]], row)
    assert kind != "afp" or "typical" in offset
    for truth, pair in offset.items():
        alone, with_it = (float(row[4].partition(" ")[0]) for row in pair)
        # On `kind` there is next to nothing to learn, and a hundredth at most may be spoilt.
        assert with_it > alone - 1.0 if truth == "kind" else with_it > alone + 2.0


@pytest.mark.parametrize("kind", ["afp", "machining"])
def test_no_tracker_is_as_good_as_one_and_encoders_in_production_are_better_in_three_axes(
    tables, kind
):
    rows = [row.strip("| ").split(" | ") for row in tables.instruments(kind).splitlines()[2:]]
    taken = {(row[0], row[1]): [float(cell.partition(" ")[0]) for cell in row[3:7]] for row in rows}
    assert len(taken) == 2 * len(tables.INSTRUMENTS)
    assert {row[-1] for row in rows} == {"5"}
    # The same seeds: what there is to correct is the same by every instrument.
    before = {}
    for each in tables.quoted():
        if each["campaign"] in tables.INSTRUMENTS and each["case"]["kind"] == kind:
            for own in each["deviations"][:4]:
                key = (*each["case"].values(), own["name"], own["load"])
                before.setdefault(key, set()).add(own["mean"][0])
    assert {len(each) for each in before.values()} == {1}
    for springs in ("`bearing`", "`auto`"):
        tracker, none = taken["tracker", springs], taken["no tracker, disk doubled", springs]
        assert none[:2] == pytest.approx(tracker[:2], abs=2.0)
        assert none[2:] == pytest.approx(tracker[2:], abs=4.0)
        read = taken["encoders in production too", springs]
        assert min(read[1] - tracker[1], read[3] - tracker[3]) > 1.0


@pytest.mark.slow
def test_a_case_measured_anew_gives_the_figures_that_are_quoted(tables, tmp_path):
    from gallery.process_figures import SHORTER, Case, Measurement

    tables.quoted()
    (campaign,) = (each for each in SHORTER if each.name == "i_optimal 8")
    (found,) = Measurement(tmp_path).of(Case("afp", "typical", 1), (campaign,))
    (stated,) = (
        each
        for each in tables.quoted()
        if each["case"] == {"kind": "afp", "preset": "typical", "seed": 1}
        and each["campaign"] == campaign.name
    )
    assert found.chosen == stated["chosen"]
    assert found.minutes == pytest.approx(stated["minutes"], abs=0.05)
    assert found.left_out == pytest.approx(stated["left_out"], rel=0.02)
    for new, old in zip(found.deviations, stated["deviations"], strict=False):
        assert new.mean == pytest.approx(tuple(old["mean"]), rel=0.03, abs=1e-6)
        assert new.max == pytest.approx(tuple(old["max"]), rel=0.03, abs=2e-6)
