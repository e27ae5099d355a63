"""Sessions of one table: a station that was set up anew, markers that were screwed on again."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from elastocal.errors import GeometryError
from elastocal.geometry import (
    GeometryProblem,
    Positions,
    geometry_model,
    plausible_ladder,
    read_positions,
)
from elastocal.geometry.ladder import climb
from elastocal.geometry.sessions import in_sessions, undo_changes
from elastocal.progress import silent
from elastocal.robot import catalogue
from support.measured_arms import Measured, measure, write_positions

ARM = catalogue.load("KR 210 R2700-2")


def changed(found: Measured, cuts: list[int], frame: float, marker: float) -> Positions:
    """Return positions whose one station, and whose markers, are elsewhere from some rows on."""
    rng, data = np.random.default_rng(0), found.data
    session = np.searchsorted(cuts, np.arange(len(data)), "right")
    seen, R_station = data.markers.copy(), found.T_station_base[0, :3, :3]
    R_tcp = found.truth.forward(data.q)[:, :3, :3]
    for number in range(1, len(cuts) + 1):
        own = session == number
        turn = Rotation.from_rotvec(0.5 * frame * rng.standard_normal(3)).as_matrix()
        seen[own] = seen[own] @ turn.T + frame * rng.standard_normal(3)
        shift = marker * rng.standard_normal(3)
        seen[own] += (R_tcp[own] @ shift @ R_station.T)[:, None]
    return replace(data, markers=seen)


def model_of(data: Positions):
    problem = GeometryProblem(ARM, data)
    return geometry_model(problem, climb(problem, 40, np.random.default_rng(0), silent), "test")


@pytest.mark.parametrize(
    ("frame", "marker", "kind"),
    [
        (5e-4, 0.0, "geometry.station-moved"),
        (0.0, 5e-4, "geometry.markers-moved"),
        (4e-4, 4e-4, "geometry.new-session"),
    ],
)
def test_three_sessions_in_one_table_are_named_with_their_rows(frame, marker, kind):
    data = changed(measure(ARM, 90, stations=1), [30, 60], frame, marker)
    found = model_of(data).findings
    assert [(each.kind, each.values["row"]) for each in found] == [(kind, 30), (kind, 60)]


@pytest.mark.slow
@pytest.mark.parametrize(("frame", "marker"), [(2e-3, 0.0), (0.0, 2e-3), (2e-2, 2e-2)])
def test_large_changes_are_undone_whether_one_place_fits_or_not(frame, marker):
    data = changed(measure(ARM, 90, markers=1, stations=1), [30, 60], frame, marker)
    rows, undone = undo_changes(GeometryProblem(ARM, data))
    assert rows == [30, 60]
    assert len(undone.stations) == (3 if frame else 1)
    assert undone.markers.shape[1] == (3 if marker else 1)


def test_sessions_that_leave_no_arm_are_refused_by_name():
    data = changed(measure(ARM, 90, markers=1, stations=1), [30, 60], 1e-3, 1e-3)
    with pytest.raises(GeometryError) as refused:
        plausible_ladder(GeometryProblem(ARM, data), 40, np.random.default_rng(0))
    text = str(refused.value)
    assert "elsewhere from rows 30 and 60 on" in text or "elsewhere from rows 30, 60 on" in text
    assert float(re.search(r"left out miss by ([\d.]+) mm", text)[1]) < 0.1


def test_rows_of_named_sessions_are_as_good_as_those_of_one():
    plain = measure(ARM, 90, stations=1)
    session = np.repeat(["mon", "tue", "wed"], 30)
    data = in_sessions(changed(plain, [30, 60], 3e-3, 3e-3), session)
    assert data.stations == ("s0, mon", "s0, tue", "s0, wed")
    assert data.markers.shape == (90, 9, 3)
    found = model_of(data)
    assert found.findings == ()
    assert found.held_out.chosen.mean < 1.3 * model_of(plain.data).held_out.chosen.mean


def test_the_column_session_names_them(tmp_path):
    path = write_positions(tmp_path / "p.csv", measure(ARM, 20, markers=2, stations=1))
    lines = path.read_text(encoding="utf-8").splitlines()
    names = ["session", *["first"] * 8, *["second"] * 12]
    joined = [f"{line},{name}" for line, name in zip(lines, names, strict=True)]
    path.write_text("\n".join(joined) + "\n", encoding="utf-8")
    data = read_positions(path, ARM)
    assert data.markers.shape == (20, 4, 3)
    seen = np.repeat([[True, True, False, False], [False, False, True, True]], [8, 12], axis=0)
    np.testing.assert_array_equal(data.seen, seen)
    assert data.stations == ("s0, first", "s0, second")
    one = [f"{line},{name}" for line, name in zip(lines, ["session", *["a"] * 20], strict=True)]
    path.write_text("\n".join(one) + "\n", encoding="utf-8")
    assert read_positions(path, ARM).stations == ("s0",)


@pytest.mark.parametrize("seed", range(4))
def test_sound_positions_have_no_sessions(seed):
    """Also of gears, a drift of some tenths of the noise and a payload that came half way."""
    kilos = (0.0,) * 40 + (80.0,) * 40
    found = measure(ARM, 80, seed=seed, gears=2e-4, payloads=kilos, compliance=2e-7)
    drift = 1e-5 * np.linspace(-1.0, 1.0, 80)[:, None, None]
    data = replace(found.data, markers=found.data.markers + drift)
    assert undo_changes(GeometryProblem(ARM, data))[0] == []
