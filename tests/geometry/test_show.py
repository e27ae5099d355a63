"""Terminal and page show the same cells of a calibrated geometry."""

import io
from types import SimpleNamespace

from elastocal.blocks import Facts, Table
from elastocal.cli.output import console, print_blocks
from elastocal.geometry import GeometryParameter, show_geometry
from elastocal.geometry.accuracy import PoseAccuracy
from elastocal.report.document import geometry_page
from elastocal.report.document.section import Content

FIGURES = SimpleNamespace(bias=1e-4, mean=2e-4, rms=3e-4, p95=4e-4, max=5e-4)
HELD_OUT = SimpleNamespace(mean=2e-4, p95=4e-4, max=5e-4)
MODEL = SimpleNamespace(
    chain=None,
    ladder=(
        SimpleNamespace(
            rung="links", unknowns=24, held_out=HELD_OUT, chosen=True, regions=HELD_OUT
        ),
    ),
    parameters=(
        GeometryParameter("link 2 along x", 4.2e-8, "m/N", 3.1e-8, 5.3e-8, True),
        GeometryParameter("gear of joint 1", 2e-6, "1", -1e-6, 5e-6, False),
    ),
    fixed=(),
    findings=(),
    blunders=(),
    functions=(
        SimpleNamespace(joint="joint_1", known=True, largest=2.2e-4, order=17, amplitude=9e-5),
    ),
    T_tcp_built=None,
)
POSES = tuple(PoseAccuracy(n, "s", 0, 3, 3e-4 * n, 1e-4 * n, 5e-5 * n) for n in (1, 2))
ACCURACY = SimpleNamespace(
    axes=(SimpleNamespace(axis="norm", registration=FIGURES, chosen=FIGURES),), poses=POSES
)


def printed():
    screen = console(stderr=False, file=io.StringIO(), width=200)
    print_blocks(screen, show_geometry(MODEL, ACCURACY))
    return screen.file.getvalue()


def test_a_compliance_of_a_link_is_shown_in_a_unit_in_which_it_is_not_nothing():
    line = next(line for line in printed().splitlines() if "link 2 along x" in line)
    assert line.split()[4:] == ["known", "+0.042", "µm/N", "+0.031", "to", "+0.053"]


def test_terminal_and_page_show_the_same_blocks():
    found = SimpleNamespace(model=MODEL, accuracy=ACCURACY)
    shown = tuple(show_geometry(MODEL, ACCURACY))
    page = Content((*geometry_page._iso(found), *shown)).html
    lines = [line.split() for line in printed().splitlines()]
    for block in shown:
        rows = block.rows if isinstance(block, Table) else ()
        for row in rows:
            assert " ".join(map(str, row)).split() in lines
            assert all(str(cell) in page for cell in row)
    facts = next(block for block in shown if isinstance(block, Facts))
    assert facts in tuple(geometry_page._iso(found))
    assert dict(facts.pairs)["RP, largest"] == "0.100 mm"


def test_functions_of_the_joints_are_shown_with_the_regions_that_decided():
    lines = [line.split() for line in printed().splitlines()]
    assert ["joint_1", "known", "220", "17", "90"] in lines
    assert ["links", "24", "0.200", "0.400", "0.500", "0.200", "taken"] in lines
