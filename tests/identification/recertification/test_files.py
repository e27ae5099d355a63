from pathlib import Path

import pytest

from elastocal.errors import IdentificationError, RobotError, SchemaError, SpringError
from elastocal.identification import write_model
from elastocal.identification.recertification import recertify, recertify_files
from support.recertified import made_up
from support.sealed import edit
from support.summaries import made_up_summary


@pytest.fixture
def paths(tmp_path) -> tuple[Path, Path]:
    for n, name in enumerate(("old", "new")):
        write_model(tmp_path / f"{name}.json", made_up(n), made_up_summary(1e-3))
    return tmp_path / "old.json", tmp_path / "new.json"


def test_files_are_compared_as_their_models(paths):
    assert recertify_files(*paths).summary == recertify(made_up(0), made_up(1)).summary


def test_one_file_under_two_names_is_refused(paths):
    again = paths[0].parent / "." / ".." / paths[0].parent.name / "old.json"
    with pytest.raises(IdentificationError, match="one and the same file"):
        recertify_files(paths[0], again)


def test_a_copy_of_a_file_is_refused(paths):
    paths[1].write_bytes(paths[0].read_bytes())
    with pytest.raises(
        IdentificationError, match=r"old\.json and .*new\.json are one and the same"
    ):
        recertify_files(*paths)


@pytest.mark.parametrize(
    ("change", "error"),
    [
        (lambda data: data["robot"].update(tcp="nowhere"), RobotError),
        (lambda data: data["springs"][1].update(joint="nowhere"), SpringError),
        (lambda data: data["compliance"].pop(), SchemaError),
        (lambda data: data.update(schema="elastocal.model/9"), SchemaError),
    ],
)
def test_a_damaged_file_is_named(paths, change, error):
    edit(paths[1], change)
    with pytest.raises(error, match=r"new\.json"):
        recertify_files(*paths)


@pytest.mark.parametrize("mean", [3e-3, 1.2e-3, None])
def test_other_loads_are_noted_where_the_files_state_them(paths, mean):
    def change(data):
        if mean is None:
            data["calibration"] = None
        else:
            data["calibration"]["deflection"]["mean"] = mean

    edit(paths[1], change)
    noted = any("was deflected by" in note for note in recertify_files(*paths).summary.notes)
    assert noted == (mean == 3e-3)


@pytest.mark.parametrize("stated", [{}, 5, {"mean": "3", "max": 1.0}, None])
def test_figures_that_are_none_are_refused_by_name(paths, stated):
    edit(paths[1], lambda data: data["calibration"].update(deflection=stated))
    with pytest.raises(SchemaError, match=r"new\.json: .*calibration\.deflection"):
        recertify_files(*paths)
