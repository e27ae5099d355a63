"""CSV tables: read by line, written whole, of any length."""

import csv
import io

import numpy as np
import pytest

from elastocal.errors import FileAccessError
from elastocal.tables import (
    Column,
    TableError,
    TableLayout,
    TableReader,
    new_table,
    opened_table,
    plain_text,
    write_table,
)

LENGTH = Column(1, "x", "mm", 1e-3)


def reader(text):
    return TableReader(io.StringIO(text, newline=""))


def test_what_stands_above_the_header_and_how_the_file_is_written_are_known():
    table = reader("# a remark\r\n\r\nname;x[mm]\r\na;1\r\n")
    assert table.layout == TableLayout(
        ("name", "x[mm]"), ("# a remark\r\n", "\r\n"), delimiter=";", line_end="\r\n"
    )


def test_rows_are_counted_as_lines_of_the_file_and_blank_ones_are_left_out():
    rows = reader('# r\na,b\n1,2\n\n , \n"3\n",4\n5,6\n').rows()
    assert rows.cells == [["1", "2"], ["3\n", "4"], ["5", "6"]]
    assert rows.lines == [3, 7, 8]
    assert len(rows) == 3


def test_pieces_are_the_rows_a_few_at_a_time():
    text = "a,b\n" + "".join(f"{n},{n}\n\n" for n in range(7))
    pieces = list(reader(text).pieces(3))
    assert [len(piece) for piece in pieces] == [3, 3, 1]
    whole = reader(text).rows()
    assert [row for piece in pieces for row in piece.cells] == whole.cells
    assert [line for piece in pieces for line in piece.lines] == whole.lines


@pytest.mark.parametrize("text", ["", "# only\n", "\n\n"])
def test_a_text_without_header_has_an_empty_one_and_no_rows(text):
    table = reader(text)
    assert table.layout.header == ()
    assert len(table.rows()) == 0


def test_a_row_of_another_length_is_found_by_its_line():
    rows = reader("a,b\n1,2\n3\n4\n").rows()
    assert rows.uneven(2) == (3, 1)
    assert reader("a,b\n1,2\n").rows().uneven(2) is None


def test_numbers_come_in_si_units():
    rows = reader("name,x[mm]\na,1500\nb, 2e3 \n").rows()
    np.testing.assert_array_equal(rows.numbers(LENGTH), [1.5, 2.0])


@pytest.mark.parametrize(
    ("cell", "said"),
    [
        ("long", "row 4, column 'x[mm]': 'long' is not a number"),
        ("", "row 4, column 'x[mm]': '' is not a number"),
        ("inf", "row 4, column 'x[mm]': 'inf' is not a finite number"),
        ("nan", "row 4, column 'x[mm]': 'nan' is not a finite number"),
        ("1_5", "row 4, column 'x[mm]': '1_5' is not a number"),
        ("\u0661", "row 4, column 'x[mm]': '\u0661' is not a number"),
    ],
)
def test_a_cell_that_is_no_number_is_refused_by_row_and_column(cell, said):
    rows = reader(f"name,x[mm]\na,1\n\nb,{cell}\n").rows()
    with pytest.raises(TableError) as caught:
        rows.numbers(LENGTH)
    assert str(caught.value) == said


def test_a_reader_of_its_own_decides_what_an_odd_cell_means():
    rows = reader("name,x\na,1\nb,\nc,2_0\n").rows()
    plain = Column(1, "x", "", 1.0)
    assert plain.header == "x"
    found = rows.numbers(plain, lambda cell: float(cell.replace("_", "") or -1))
    assert found.tolist() == [1.0, -1.0, 20.0]


def test_quotes_that_do_not_match_are_refused_by_row():
    with pytest.raises(TableError, match=r"^row 3: unexpected end of data$"):
        reader('# r\na,b\n1,"2\n').rows()


def test_a_table_comes_back_as_it_was_written(tmp_path):
    path = tmp_path / "a.csv"
    write_table(path, ("name", "x[m]"), [('a,\n"é', 0.1), ("", -0.0)], ["# remark\n"])
    assert path.read_text() == '# remark\nname,x[m]\n"a,\n""é",0.1\n,-0.0\n'
    with opened_table(path) as table:
        assert table.rows().cells == [['a,\n"é', "0.1"], ["", "-0.0"]]


def test_a_table_is_written_back_in_its_own_layout(tmp_path):
    text = "# r\r\nname;x[mm]\r\na;1\r\n"
    table = reader(text)
    with new_table(tmp_path / "a.csv", table.layout) as write:
        for piece in table.pieces(1):
            write(piece.cells)
    assert (tmp_path / "a.csv").read_bytes() == text.encode()


def test_a_table_that_fails_half_way_leaves_nothing(tmp_path):
    def rows():
        yield ("a",)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_table(tmp_path / "a.csv", ["name"], rows())
    assert not list(tmp_path.iterdir())


def test_what_cannot_be_opened_or_is_no_text_is_named(tmp_path):
    path = tmp_path / "a.csv"
    with pytest.raises(FileAccessError, match=r"cannot read .*a\.csv: No such file"):
        next(iter([opened_table(path).__enter__()]))
    path.write_bytes(b"a,b\n\xff\n")
    with (
        pytest.raises(FileAccessError, match=r"a\.csv: not a UTF-8 text file .Excel"),
        opened_table(path) as table,
    ):
        table.rows()


def test_a_decimal_comma_is_read_where_another_delimiter_parts_the_cells():
    rows = reader("name;x[mm]\na;1500,5\nb;-2\n").rows()
    assert rows.decimal_comma
    np.testing.assert_array_equal(rows.numbers(LENGTH), [1500.5e-3, -2e-3])


@pytest.mark.parametrize(
    ("text", "cell"), [("a;1,500\n0.5;2\n", "1,500"), ("a;1,2,3\n", "1,2,3"), ("a;1,5\nb;x\n", "x")]
)
def test_a_comma_beside_points_may_part_thousands(text, cell):
    rows = reader(f"name;x[mm]\n{text}").rows()
    with pytest.raises(TableError, match=f"{cell!r} is not a number"):
        rows.numbers(LENGTH)


def test_a_comma_that_parts_the_cells_is_no_decimal_comma():
    assert not reader('name,x[mm]\n"a,5","1,5"\n').rows().decimal_comma


@pytest.mark.parametrize("text", ["=1+1", "+cmd|' /C calc'!A0", "-2+3", "@SUM(A1)", "\t=1"])
def test_no_text_is_written_that_a_spreadsheet_would_compute(tmp_path, text):
    write_table(tmp_path / "a.csv", [text, "n[m]"], [[text, -1.5], ["-1,5", "+2e-3"]])
    cells = list(csv.reader(io.StringIO((tmp_path / "a.csv").read_text("utf-8"))))
    assert cells == [[f"'{text}", "n[m]"], [f"'{text}", "-1.5"], ["-1,5", "+2e-3"]]
    with opened_table(tmp_path / "a.csv") as table:
        assert table.layout.header[0] == text
        assert plain_text(table.rows().cells[0][0]) == text


@pytest.mark.parametrize(
    ("text", "row"),
    [("a,b\n1," + 4_000_000 * "2", "row 2"), ("\n" * 4_000_001 + "a\n1\n", "row 4000001")],
    ids=["a line", "the head"],
)
def test_no_line_and_no_head_fills_the_memory(tmp_path, text, row):
    (tmp_path / "a.csv").write_text(text)
    with (
        pytest.raises(TableError, match=rf"^{row}\b.* is more than 4000 kB .*ROW_KB"),
        opened_table(tmp_path / "a.csv") as table,
    ):
        table.rows()
