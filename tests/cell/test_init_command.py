"""``elastocal init``, called as a function; the command line registers it."""

import pytest

from elastocal.cli.commands.init import _init
from elastocal.errors import FileAccessError


def test_init_writes_a_cell_and_says_what_comes_next(tmp_path, capsys):
    _init(tmp_path / "new", like="machining")
    names = {p.name for p in (tmp_path / "new").iterdir()}
    assert names == {"cell.yaml", "block.stl", "process.csv"}
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "elastocal check" in shown.err
    with pytest.raises(FileAccessError, match="--force"):
        _init(tmp_path / "new", like="machining")
