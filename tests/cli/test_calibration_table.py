"""The table of springs in a terminal: every number whole, and at bound only where it is one."""

import io
import re
from collections import Counter
from dataclasses import replace

import pytest

from elastocal.blocks import Table
from elastocal.cli.output import bold, console, print_blocks, table_of, visible
from elastocal.identification import spring_table
from elastocal.identification.figures import SpringSummary
from elastocal.identification.show import show_calibration
from support.summaries import made_up_summary

NAME = "joint_2.axial with a long name, slip 3"
ROWS = (
    SpringSummary(NAME, "gear", "rad/(N*m)", 1.23456e-7, -2.5e-8, 1.25e-6, True),
    SpringSummary("rail.axial", "hinge", "m/N", 1.447e-7, 3.8e-8, 2.86e-7, True),
)


@pytest.mark.parametrize("name", ["a[/b]", "[bold]x[/]", "a:warning:b", "\x1b[31mred", "\udcff"])
def test_a_name_is_shown_as_it_is_in_lines_and_tables(name):
    screen = console(stderr=False, file=io.StringIO(), width=200)
    screen.print(f"{bold(name)} {name}")
    screen.print(table_of(spring_table([replace(ROWS[0], name=name)])))
    assert screen.file.getvalue().count(visible(name)) == 3
    assert "\x1b" not in screen.file.getvalue()


@pytest.mark.parametrize("width", [80, 120])
def test_no_number_is_cut(width):
    screen = console(stderr=False, file=io.StringIO(), width=width)
    screen.print(table_of(spring_table(ROWS)))
    shown = screen.file.getvalue()
    for number in ("0.1235", "-0.025 … 1.250", "8.100", "0.1447 µm/N", "6.911 MN/m"):
        assert number in shown
    assert max(map(len, shown.splitlines())) <= width


def test_every_spring_of_a_rich_model_has_one_line_of_80_columns():
    """Names, notes of bounds and what gears amount to were folded over two and three lines."""
    gear = "joint_a2.axial"
    springs = (
        SpringSummary(gear, "gear", "rad/(N*m)", 1.2e-7, 1e-7, 1.5e-7, True),
        SpringSummary(f"{gear} at 1600 N·m", "gear", "rad/(N*m)", 1e-7, 1e-7, 1.5e-7, True),
        SpringSummary(f"{gear} lost motion", "gear", "rad", 5e-5, 4e-5, 1.2e-4, True),
        SpringSummary(
            "joint_a1.bend-normal", "hinge", "rad/(N*m)", 0.0, 0.0, 1.15e-7, True, at_bound=True
        ),
        SpringSummary("joint_a5.x", "hinge", "rad/(N*m)", 1e-7, 0.0, 1.15e-7, False, group=1),
    )
    screen = console(stderr=False, file=io.StringIO(), width=80)
    screen.print(table_of(spring_table(springs)))
    _, _, *rows = screen.file.getvalue().splitlines()
    assert [row.split("  ")[0].strip() or row.strip()[:11] for row in rows] == [
        gear,
        "at 1600 N·m",
        "lost motion",
        "joint_a1.bend-normal",
        "joint_a5.x",
    ]
    assert rows[3].rstrip().endswith("above 8.696  below 0.115")
    assert rows[4].rstrip().endswith("in group 1")


def test_no_figure_is_cut_at_any_width():
    """At 80 columns "below 0.454" was "below 0.45", and "in group 32" was "in group 3"."""
    gear = "joint_a1.axial"
    springs = (
        SpringSummary("rail.axial", "hinge", "m/N", 0.0, 0.0, 4.54e-7, True, at_bound=True),
        SpringSummary(f"{gear} lost motion", "gear", "rad", 5e-5, 4e-5, 1.2e-4, True),
        SpringSummary("joint_a1.bend-normal", "hinge", "rad/(N*m)", 1e-7, 0.0, 1e-6, True),
        SpringSummary("joint_a1.x", "hinge", "rad/(N*m)", 0.0, 0.0, 1e-7, False, group=32),
    )
    table = spring_table(springs)
    cells = [getattr(cell, "text", cell) for row in table.rows for cell in row[1:]]
    figures = Counter(re.findall(r"\d+(?:\.\d+)?", " ".join(cells)))
    for width in range(40, 121):
        screen = console(stderr=False, file=io.StringIO(), width=width)
        print_blocks(screen, [table])
        shown = Counter(re.findall(r"\d+(?:\.\d+)?", screen.file.getvalue()))
        assert not figures - shown, width
        assert max(map(len, screen.file.getvalue().splitlines())) <= width


def known(value, low, high, **more):
    """Return what the last cell of a spring's row says."""
    spring = SpringSummary(
        "joint_1.x", "hinge", "rad/(N*m)", 1e-6 * value, 1e-6 * low, 1e-6 * high, True, **more
    )
    cell = spring_table([spring]).rows[0][-1]
    return getattr(cell, "text", cell)


def test_a_negative_value_is_at_no_bound_unless_the_fit_says_so():
    assert known(-1.0, -1.1, -0.9) == "±10%"
    assert known(0.0, 0.0, 0.5, at_bound=True) == "below 0.500"
    assert known(2.0, 1.5, 2.0, at_bound=True) == "above 1.500"
    assert known(0.0, 0.0, 0.0, at_bound=True) == "at bound"
    assert known(0.0, -0.5, 0.5) == ""


def test_what_is_hardly_known_or_outside_its_interval_is_said_so():
    assert known(0.01, 0.0, 5.0) == "more than ±1000%"
    assert known(3.0, 1.0, 2.0) == "outside its interval: do not use, was the file changed?"
    assert known(1.0, 0.9, 1.1, prior=True) == "±10%, prior"


def test_parameters_are_counted_beside_springs_where_they_differ():
    found = replace(made_up_summary(), springs_total=11, spring_count=9)
    for summary, said in (
        (replace(made_up_summary(), springs_total=6), ": 6 springs, "),
        (found, ": 9 springs with 11 parameters, "),
    ):
        assert said in next(iter(show_calibration(summary))).text


def test_headings_are_folded_until_no_number_is_cut():
    heads = ("Technique", *(f"a long heading of column {k}, mean" for k in range(4)))
    block = Table("Wide", heads, (("cover (not used)", *(["1234.5 mm"] * 4)),))
    screen = console(stderr=False, file=io.StringIO(), width=80)
    print_blocks(screen, [block])
    lines = screen.file.getvalue().splitlines()
    assert lines[0].strip() == "Wide"
    assert lines[-1].split() == ["cover", "(not", "used)", *(["1234.5", "mm"] * 4)]
    assert max(map(len, lines)) <= 80


@pytest.mark.parametrize("width", [40, 60, 80, 120])
def test_a_table_that_is_too_wide_is_shown_in_parts_without_cutting_a_number(width):
    heads = ("Training poses", *(f"variant {number}" for number in range(8)))
    rows = tuple((n, *(f"{1000 * k + n}.5 / {6000 + n}.7" for k in range(8))) for n in (1, 2))
    screen = console(stderr=False, file=io.StringIO(), width=width)
    print_blocks(screen, [Table("Errors", heads, rows, texts=0)])
    printed = screen.file.getvalue()
    assert max(map(len, printed.splitlines())) <= width
    words = printed.split()
    for row in rows:
        assert row[0] in map(int, filter(str.isdigit, words))
        for cell in row[1:]:
            assert cell in printed
    assert printed.count("Errors") == 1
