"""``elastocal init``."""

from support.cli import elastocal


def test_init_writes_a_cell_and_says_what_comes_next(tmp_path):
    shown = elastocal("init", tmp_path / "new", "--like", "machining")
    names = {p.name for p in (tmp_path / "new").iterdir()}
    assert names == {"cell.yaml", "block.stl", "process.csv"}
    assert shown.out == ""
    assert "elastocal check" in shown.err
    assert "--force" in elastocal("init", tmp_path / "new", "--like", "machining").reason
