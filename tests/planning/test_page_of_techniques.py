"""Tables of the pages on choosing and planning poses: COVER and IOOPS on the example cell."""

import re
from pathlib import Path

import pytest

import elastocal as ec
from elastocal.cell.examples import write_example
from elastocal.planning import read_plan
from elastocal.wording import duration

pytestmark = pytest.mark.slow

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = DOCS / "explanation/choosing-poses.md"
ROW = re.compile(
    r"^\| (?:(\d), (\d+) poses)? ?\| (cover|ioops) \| (\d+) mm \| (\d+) mm \| (\d+) mm"
    r" \| (0\.\d+) \|$",
    flags=re.MULTILINE,
)


def told_by_the_page():
    """Return what the page says of each seed: its number of poses, and a row a technique."""
    told = {}
    for seed, poses, technique, *figures in ROW.findall(PAGE.read_text(encoding="utf-8")):
        if seed:
            told[int(seed)] = latest = {"poses": int(poses)}
        latest[technique] = figures
    return told


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_table_is_what_plans_of_the_example_say(tmp_path, seed):
    cell = write_example(tmp_path / "cell", "afp")[0]
    text = re.sub(r"(?ms)^process:.*?(?=^\S|\Z)", "", cell.read_text(encoding="utf-8"))
    search = f'search: {{technique: cover, d_max: "175 mm", pool: 3000, seed: {seed}}}\n'
    text, replaced = re.subn(r"(?ms)^search:.*?(?=^\S|\Z)", search, text)
    assert replaced == 1
    cell.write_text(text, encoding="utf-8")
    ec.plan(cell, out=tmp_path / "plan", compare="ioops")
    plan = read_plan(tmp_path / "plan")
    told = told_by_the_page()[seed]
    assert told.pop("poses") == len(plan.poses)
    found = {
        each.name: [
            *(
                f"{1e3 * length:.0f}"
                for length in (
                    each.spread.boundary_distance,
                    each.spread.nearest_neighbour,
                    each.spread.covering_radius,
                )
            ),
            f"{each.spread.o1:.4f}",
        ]
        for each in (plan.search, plan.comparison)
    }
    assert told == found
    if seed == 1:
        how_to = (DOCS / "how-to/plan-poses.md").read_text(encoding="utf-8")
        assert f"Total time: {duration(plan.total_time)}\n" in how_to
