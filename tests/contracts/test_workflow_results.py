"""Every result of a workflow: short in a console, a table in a notebook, a picture or a reason."""

import importlib.util
import re
import sys
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from elastocal import workflows
from elastocal.codec.study import study_summary
from elastocal.compensation.process import read_process
from elastocal.errors import ReportError
from elastocal.procedure import RunEnd
from elastocal.results import MOST_CHARACTERS, MOST_LINES, Result
from elastocal.robot import catalogue
from elastocal.verdict import Evidence, judge_evidence
from support import (
    foreign_logs,
    kuka_bench,
    live_bench,
    measured_arms,
    plans,
    reported,
    shown,
    studies,
    two_arms,
)

CLASSES = {
    name: getattr(workflows, name)
    for name in dir(workflows)
    if name.endswith("Result") and issubclass(getattr(workflows, name), Result)
}
WITHOUT = {
    "ImportPositionsResult",
    "CheckResult",
    "GuessMapResult",
    "DryRunResult",
    "ExportResult",
    "InitResult",
    "KrcConfigResult",
    "LiveResult",
    "MeasureDelayResult",
    "NewResult",
    "PairResult",
    "ReleaseResult",
    "ReportResult",
    "SimulatePairResult",
    "SimulateResult",
    "StudioResult",
    "ToolResult",
    "VerifyResult",
    "WatchResult",
}
"""Results that no picture shows."""


@pytest.fixture(scope="module")
def results(tmp_path_factory) -> dict[str, Result]:
    """One result of each workflow, by the name of its class."""
    done = reported.finished()
    out = tmp_path_factory.mktemp("results")
    run = reported.copied(done, out) / "run"
    model, path, cell = done / "model.json", done / "process" / "path.csv", done / "cell/cell.yaml"
    derived = workflows.derive(run)
    process = read_process(done / "process").table
    design = studies.settings()
    logs = foreign_logs.write_logs(foreign_logs.rows_of(run), out)
    arm = measured_arms.measure(catalogue.load("KR 210 R2700-2"), 60)
    positions = measured_arms.write_positions(out / "positions.csv", arm)
    log_map = foreign_logs.write_map(out, cell)
    samples = tuple(studies.batch(range(3)))
    figures = workflows.RunFigures(
        str(run), "done", "at HOME", "", 7, 7, (), {"ok": 14}, 0, 60.0, "dataset.nc", (), None
    )
    settings = workflows.RunSettings(cell, plan=done / "plan", out=out / "dry")
    arms = two_arms.finished()
    both, own = arms / "cell.yaml", (arms / "run" / "left.nc", arms / "run" / "right.nc")
    made = (
        workflows.calibrate_pair(both, *own, out=out / "pair_models", draws=40),
        workflows.simulate_pair(both, plan=arms / "plan.json", out=out / "pair"),
        workflows.calibrate(run / "dataset.nc", springs="actuated", out=out / "other.json"),
        workflows.check(run),
        workflows.codec(run / "dataset.nc", out=out / "codec_again"),
        workflows.compare(model, new=out / "other.json", rows=path),
        workflows.compensate(model, path=path, out=out / "corrected.csv"),
        derived,
        workflows.dry_run(settings),
        workflows.DemoResult(out, process, judge_evidence(Evidence(made=reported.MADE))),
        workflows.export(model, out=out / "c"),
        workflows.geometry(positions, robot="KR 210 R2700-2", tcp="flange", draws=40),
        workflows.guess_map(logs),
        workflows.import_logs(logs, map=log_map),
        workflows.import_positions(logs, map=log_map),
        workflows.init(out / "new"),
        workflows.krc_config(kuka_bench.write_cell(out), out=out / "krc"),
        workflows.NewResult(out / "cell.yaml", "UR20", ("an open mesh",)),
        live_bench.result(),
        workflows.MeasureDelayResult(out / "record.json", kuka_bench.record()),
        plans.plan(),
        workflows.predict(model, rows=path),
        workflows.release(cell),
        workflows.report(run, out=out / "report.html"),
        workflows.RunResult(figures, RunEnd.DONE, derived.summary, None),
        process,
        workflows.simulate(cell, meanwhile=lambda _: None),
        workflows.stiffness(model, path=path, spins=4, external_positions=3, stations=5),
        workflows.StudyResult(study_summary(design, samples, None), design, samples, ()),
        workflows.studio(cell, while_open=lambda _: None),
        workflows.tool(run),
        workflows.verify(run),
        workflows.watch(cell, duration=0.3),
    )
    return {type(each).__name__: each for each in made}


def test_every_result_is_tried(results):
    assert results.keys() == CLASSES.keys()


@pytest.mark.parametrize("name", CLASSES)
def test_it_is_short_in_a_console(results, name):
    text = repr(results[name])
    assert text.splitlines()[0] == name
    assert 2 < len(text.splitlines()) <= MOST_LINES
    assert len(text) <= MOST_CHARACTERS
    assert not re.search(r"array|object at 0x|\w\(\w+=", text), "no dump of fields"


@pytest.mark.parametrize("name", CLASSES)
def test_it_is_a_table_in_a_notebook(results, name):
    html = results[name]._repr_html_()
    assert html.startswith(f"<table><caption>{name}</caption><tr>")
    assert html[: html.index("</table>")].count("<tr>") == len(results[name].facts())


@pytest.mark.parametrize("name", CLASSES)
def test_every_shell_shows_the_same_cells(results, name, tmp_path):
    shown.assert_one_telling(results[name], tmp_path)


@pytest.mark.slow
def test_every_shell_shows_the_same_cells_of_a_foreign_campaign(tmp_path):
    place = Path(__file__).parents[2] / "benchmarks" / "first_use.py"
    spec = importlib.util.spec_from_file_location("first_use", place)
    first_use = importlib.util.module_from_spec(spec)
    sys.modules["first_use"] = first_use
    spec.loader.exec_module(first_use)
    arm = next(iter(first_use.ARMS))
    first_use.write_campaign(arm, tmp_path, masses=True)
    steps = [each.command for each in first_use.first_use(arm, tmp_path)]
    assert steps[-1] == "verify"
    data, model = tmp_path / "data.nc", tmp_path / "model.json"
    other = workflows.calibrate(data, springs="actuated", out=tmp_path / "other.json")
    results = (
        workflows.check(tmp_path / "cell.yaml"),
        workflows.calibrate(data),
        other,
        workflows.compare(model, new=tmp_path / "other.json"),
        workflows.codec(data, out=tmp_path / "codec2", splits=2),
        workflows.verify(tmp_path / "report.html"),
    )
    tables = sum(shown.assert_one_telling(each, tmp_path) for each in results)
    assert tables > 6


@pytest.mark.parametrize("name", CLASSES)
def test_it_has_a_picture_or_says_what_has(results, name):
    if name in WITHOUT:
        with pytest.raises(ReportError, match=r"^there is no picture of .*: pictures show [^\n]*$"):
            results[name].plot()
    else:
        figure = results[name].plot()
        assert isinstance(figure, Figure)
        assert figure.axes
