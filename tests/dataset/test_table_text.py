import pytest

from elastocal.dataset._store import attribute_lines, cut
from elastocal.errors import DatasetError


def test_attributes_survive_their_comment_lines():
    attributes = {"robot_name": 'a "b"\n#\té', "provenance": "# x: y"}
    assert cut("".join(attribute_lines(attributes)) + "a\n1\n").attributes == attributes


def test_remarks_of_a_person_are_passed_over():
    table = cut('# measured on monday\n# note: by hand\n# humidity: "low"\n\na,b\n1,2\n')
    assert table.attributes == {}
    assert table.header == ("a", "b")


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_the_delimiter_of_the_header_is_used(delimiter):
    assert cut(f"a{delimiter}b\n1{delimiter}2\n").rows.cells == [["1", "2"]]


def test_rows_are_counted_as_lines_of_the_file_and_blank_ones_passed_over():
    table = cut("# remark\n\na,b\n1,2\n\n,\n3,4\n")
    assert table.rows.lines == [4, 7]
    assert table.rows.cells == [["1", "2"], ["3", "4"]]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a,b\n1,2\n3\n", "row 3 has 1 cells, the header has 2"),
        ("# r\na,b\n1,5,2,5\n", "row 3 has 4 cells, the header has 2 (with a decimal comma"),
        ('# schema: "a"\n# schema: "a"\na\n1\n', "row 2: attribute 'schema' stands twice"),
        ("a,b\n", "file has a header but no row"),
        ("# only\n", "file has no header line, only comments"),
        ('a,b\n1,"2\n', "row 2: unexpected end of data"),
        (
            '# robot_udrf: "x"\na\n1\n',
            "row 1: attribute 'robot_udrf' is not known; did you mean 'robot_urdf'?",
        ),
        (
            "# schema: elastocal.dataset/1\na\n1\n",
            "row 1: attribute 'schema' is 'elastocal.dataset/1': it must be a text in",
        ),
    ],
)
def test_text_that_cannot_be_cut_is_refused_by_row(text, message):
    with pytest.raises(DatasetError) as caught:
        cut(text)
    assert str(caught.value).startswith(message)
