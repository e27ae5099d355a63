"""The folder of a simulated process, written and read."""

import numpy as np
import pytest

from elastocal.compensation.process import (
    CourseDeviation,
    DeviationComparison,
    ProcessRun,
    SimulatedProcess,
    SimulateProcessResult,
    compare_deviations,
    pooled,
    read_process,
    read_table,
    write_process,
)
from elastocal.errors import CompensationError, FileAccessError, SchemaError


def trace(seed: int, course: str, cycles: int) -> CourseDeviation:
    rng = np.random.default_rng([seed, cycles])
    time = 0.0025 * np.arange(1.0, cycles + 1.0)
    before, after = 1e-3 * rng.standard_normal((2, cycles))
    return CourseDeviation(
        seed, course, time, rng.standard_normal((cycles, 3)), before, 0.1 * after
    )


@pytest.fixture
def record() -> SimulatedProcess:
    traces = [trace(seed, f"course, {n}", 20 + n) for seed in (3, 5) for n in (1, 2)]
    each = []
    for seed in (3, 5):
        own = [t for t in traces if t.seed == seed]
        each.append(
            compare_deviations(f"seed {seed}", [t.before for t in own], [t.after for t in own])
        )
    runs = tuple(
        ProcessRun(seed=seed, model="m.json", model_sha256="0", tool=None, tool_sha256=None)
        for seed in (3, 5)
    )
    table = SimulateProcessResult(
        cell="hall 3", process="afp", runs=runs, settings={"cycle": 0.0025}, versions={},
        lines=(*each, pooled("all seeds", each)), budget=tuple(each[:1]),
    )  # fmt: skip
    return SimulatedProcess(table, tuple(traces))


def test_what_is_written_is_read(record, tmp_path):
    write_process(tmp_path, record)
    again = read_process(tmp_path)
    assert again.table == record.table
    assert [(t.seed, t.course) for t in again.courses] == [
        (t.seed, t.course) for t in record.courses
    ]
    for found, wanted in zip(again.courses, record.courses, strict=True):
        np.testing.assert_allclose(found.time, wanted.time, atol=1e-9)
        np.testing.assert_allclose(found.position, wanted.position, atol=1e-9)
        np.testing.assert_allclose(found.before, wanted.before, atol=1e-9)
        np.testing.assert_allclose(found.after, wanted.after, atol=1e-9)


def test_a_line_is_a_comparison_again(record):
    line = record.table.lines[0]
    made = DeviationComparison.of(line.name, line.points, line.before, line.after)
    assert made.reduction.mean == pytest.approx(line.reduction.mean)
    assert made.points == line.points


def test_deviations_of_another_table_are_refused(record, tmp_path):
    write_process(tmp_path, record)
    path = tmp_path / "deviations.csv"
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:-1]))
    with pytest.raises(CompensationError, match=r"does not belong to table.json: seed 5 has 42"):
        read_process(tmp_path)
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:5]))
    with pytest.raises(CompensationError, match=r"does not belong to table.json: seed 3 has 4"):
        read_process(tmp_path)


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("3,course,0.1,1,2,3,4", "line 3 has 7 fields, not 8"),
        ("3,course,0.1,1,2,3,4,nan", r"line 3: after\[mm\] 'nan' is not a number"),
        ("three,course,0.1,1,2,3,4,5", "line 3: seed 'three' is not a number"),
    ],
)
def test_a_damaged_row_is_refused_by_line(record, tmp_path, line, reason):
    write_process(tmp_path, record)
    path = tmp_path / "deviations.csv"
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines[:2], line, *lines[3:]]))
    with pytest.raises(CompensationError, match=reason):
        read_process(tmp_path)


def test_a_header_without_the_place_is_refused(record, tmp_path):
    write_process(tmp_path, record)
    path = tmp_path / "deviations.csv"
    path.write_text(path.read_text().replace("x[mm],", "", 1))
    with pytest.raises(CompensationError, match="is not that of deviations"):
        read_process(tmp_path)


def test_a_table_of_another_version_is_refused(record, tmp_path):
    write_process(tmp_path, record)
    path = tmp_path / "table.json"
    path.write_text(path.read_text().replace("elastocal.process/1", "elastocal.process/2"))
    with pytest.raises(SchemaError, match=r"has schema 'elastocal.process/2'"):
        read_table(path)


def test_a_folder_without_a_table_is_refused(tmp_path):
    with pytest.raises(FileAccessError, match=r"cannot read .*table.json"):
        read_process(tmp_path)
