"""Logs of any form become one table of named columns."""

import datetime
import os
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from openpyxl import Workbook

from elastocal.errors import FileAccessError, LogError
from elastocal.logs.guess import guess_log
from elastocal.logs.recordings import read_workbook
from elastocal.logs.table import read_text_log


def _log(folder, text, encoding="utf-8"):
    path = folder / "log.txt"
    path.write_bytes(text.encode(encoding))
    return read_text_log(path)


@pytest.mark.parametrize(
    ("text", "header"),
    [
        ("t,x\n0.5,1\n1.5,2\n", ("t", "x")),
        ("t;x\n0,5;1,0\n1,5;2,0\n", ("t", "x")),
        ("t\tx\r\n0.5\t1\r\n1.5\t2\r\n", ("t", "x")),
        ("# box 7\n\n// of Monday\nt x\n0.5 1\n1.5 2\n", ("t", "x")),
        ("0.5 1\n1.5 2\n", ("1", "2")),
        ("0,5 1,0\n1,5 2,0\n", ("1", "2")),
        ('"t";"x"\n"0,5";"1"\n"1,5";"2"\n', ("t", "x")),
        ("made by a box, v2\nt,x\n0.5,1\n1.5,2\n2.5,3\n", ("t", "x")),
    ],
)
def test_delimiter_decimal_mark_header_and_comments_are_told(tmp_path, text, header):
    table = _log(tmp_path, text)
    assert table.header == header
    assert table.numbers(header[0])[:2].tolist() == [0.5, 1.5]
    assert table.numbers("2")[:2].tolist() == [1.0, 2.0]


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "cp1252"])
def test_code_pages_of_windows_are_read(tmp_path, encoding):
    assert _log(tmp_path, "Fä,Größe\n1,2\n", encoding).header == ("Fä", "Größe")


def test_a_point_list_of_spatial_analyzer_is_read(tmp_path):
    text = "// SA\nCol Grp p1 1.0 2.0 3.0\nCol Grp p2 4.0 5.0 6.0\n"
    table = _log(tmp_path, text)
    assert table.numbers("4").tolist() == [1.0, 4.0]
    assert table.texts("3") == ("p1", "p2")


@pytest.mark.parametrize(
    ("cell", "seconds"),
    [
        ("1970-01-01T00:01:00.5Z", 60.5),
        ("1970-01-01 00:01:00,5", 60.5),
        ("1.1.1970 00:01:00.5", 60.5),
        ("1970/01/01 00:01:00", 60.0),
        ("1.1.1970 0:01:00", 60.0),
        ("1/2/1970 0:01:00.5", 86460.5),
        ("01/13/1970 12:01:00 AM", 12 * 86400 + 60.0),
        ("13/01/1970 12:01:00 PM", 12 * 86400 + 43260.0),
        ("01:00:00.25", 3600.25),
        ("1.5e3", 1500.0),
    ],
)
def test_dates_times_of_day_and_numbers_are_times(tmp_path, cell, seconds):
    table = _log(tmp_path, f"time;x\n{cell};1\n")
    assert table.seconds("time").tolist() == [seconds]


def test_of_dates_between_slashes_the_number_that_changes_at_midnight_is_the_day(tmp_path):
    for dates in (["3/4/2026", "3/5/2026"], ["4/3/2026", "5/3/2026"]):
        rows = f"{dates[0]} 23:59:59;1\n{dates[1]} 0:00:01;1"
        assert np.diff(_log(tmp_path, f"time;x\n{rows}\n").seconds("time")).tolist() == [2.0]


def test_a_time_of_day_goes_on_beyond_midnight(tmp_path):
    table = _log(tmp_path, "time;x\n23:59:59.0;1\n00:00:01.0;1\n")
    assert np.diff(table.seconds("time")).tolist() == [2.0]


@pytest.mark.parametrize("cell", ["\u0661\u0662", "1_000"])
def test_digits_of_other_scripts_and_groups_of_them_are_no_numbers(tmp_path, cell):
    with pytest.raises(LogError):
        _log(tmp_path, f"t,x\n0.5,1\n1.5,{cell}\n2.5,3\n").numbers("x")


def test_empty_cells_are_not_numbers_but_known(tmp_path):
    values = _log(tmp_path, "t,x\n1,\n2,nan\n3,4\n").numbers("x")
    assert np.isnan(values).tolist() == [True, True, False]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t,x\n1,2\n3\n4,5\n", "row 2 of the data has 1 cells, the others 2"),
        ("# nothing\n\n", "there are no rows in it"),
        ("t,x\n1,2_000\n", "'2_000' is not a number"),
        ("t,x\n1,0x10\n", "'0x10' is not a number"),
        ("a,a\n1,2\n", "'a' is there twice: name it by its number"),
    ],
)
def test_what_is_no_table_is_refused_by_row(tmp_path, text, message):
    with pytest.raises(LogError, match=message):
        _log(tmp_path, text).numbers("a" if text.startswith("a") else "x")


def test_a_column_that_is_missing_is_named_with_the_nearest(tmp_path):
    with pytest.raises(LogError, match=r"no column 'Forcex'; did you mean 'ForceX'\?"):
        _log(tmp_path, "ForceX,t\n1,2\n").column("Forcex")


def test_what_is_no_text_is_refused(tmp_path):
    (tmp_path / "log.csv").write_bytes(b"\x7fELF\0\0\0")
    with pytest.raises(LogError, match="is no text"):
        read_text_log(tmp_path / "log.csv")
    with pytest.raises(FileAccessError):
        read_text_log(tmp_path / "none.csv")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1,2\n" * 110_000 + "3,x\n", "row 110001 of the data, column '2': 'x' is not a number"),
        ("1,2\n" * 110_000 + "3\n4,5\n", "row 110001 of the data has 1 cells, the others 2"),
        (",".join(["1"] * 10_001), "10001 cells is more than 10000 columns"),
        ("1 " * 2_000_001, "row 1 is more than 4000 kB"),
    ],
)
def test_a_row_far_down_is_named_as_one_at_the_top(tmp_path, text, message):
    with pytest.raises(LogError, match=message):
        _log(tmp_path, text).numbers("2")


def test_words_far_above_the_numbers_and_alone_are_read(tmp_path):
    assert _log(tmp_path, "a,b\n" * 500 + "t,x\n1,2\n").numbers("x").tolist() == [2.0]
    table = _log(tmp_path, "name,word\n" + "p,q\n" * 300)
    assert (table.header, len(table), set(table.texts("word"))) == (("name", "word"), 300, {"q"})
    assert len(_log(tmp_path, "1;2\n" * 300 + "1;2;3\n" * 400)) == 400
    assert _log(tmp_path, "one\ttwo\n" * 250 + "1 2\t3\t4\n" * 251).header == ("1", "2", "3")


def test_a_long_log_takes_less_than_three_times_its_size(tmp_path):
    row = "0.0040,-123.456789,98.765432,-45.678901,0.123456,1.234567,-2.345678\n"
    (tmp_path / "log.csv").write_text(row * 15_000)
    size = (tmp_path / "log.csv").stat().st_size
    tracemalloc.start()
    table = read_text_log(tmp_path / "log.csv")
    kept = tracemalloc.get_traced_memory()[0]
    assert table.numbers("7")[-1] == -2.345678
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert kept < 1.2 * size
    # A piece is in work, beside what is kept.
    assert peak < 1.2 * size + 25e6


def test_what_a_shell_pipes_is_read(tmp_path):
    reading, writing = os.pipe()
    os.write(writing, b"t,x\n1,2\n")
    os.close(writing)
    assert read_text_log(Path(f"/dev/fd/{reading}")).numbers("x").tolist() == [2.0]
    os.close(reading)


@pytest.mark.slow
def test_a_sheet_of_a_workbook_is_read(tmp_path):
    book, path = Workbook(), tmp_path / "log.xlsx"
    book.active.append(["time", "x"])
    book.active.append([datetime.datetime(1970, 1, 1, 0, 1), 2.5])
    book.create_sheet("other").append([1, 2])
    book.save(path)
    table = read_workbook(path)
    assert table.seconds("time").tolist() == [60.0]
    assert table.numbers("x").tolist() == [2.5]
    assert read_workbook(path, "other").header == ("1", "2")
    with pytest.raises(LogError, match=r"no sheet 'third' \(Sheet, other\)"):
        read_workbook(path, "third")
    (tmp_path / "bad.xlsx").write_bytes(b"PK\x03\x04 but not")
    with pytest.raises(LogError, match="is no Excel workbook"):
        read_workbook(tmp_path / "bad.xlsx")


POLYWORKS = """\
PolyWorks|Inspector 2022 IR4 - Text Report
Project: dome section

Name\tX\tY\tZ\tTime
\t[mm]\t[mm]\t[mm]\t[s]
point 1\t2412.0710\t-310.4420\t1203.1180\t12.340
point 2\t2412.0812\t-310.4419\t1203.1182\t12.350
"""


def test_a_row_of_units_under_the_names_belongs_to_them(tmp_path):
    table = _log(tmp_path, POLYWORKS)
    assert table.header == ("Name", "X [mm]", "Y [mm]", "Z [mm]", "Time [s]")
    np.testing.assert_array_equal(table.numbers("X [mm]"), [2412.0710, 2412.0812])
    columns = {each.key: each for each in guess_log("log.txt", None, table).columns}
    assert columns["markers"].columns == ("X [mm]", "Y [mm]", "Z [mm]")
    assert (columns["markers"].unit, columns["time"].unit) == ("mm", "s")
