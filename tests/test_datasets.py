"""Readings to try things on."""

import pytest

import elastocal as ec
from elastocal import datasets
from elastocal.errors import FileAccessError

PUBLISHED = [861581.36, 2856010.99, 1848331.17, 279351.74, 418673.14, 277720.02]
"""Stiffnesses that the source of the readings gives, in N·m/rad, with five readings left out."""


def test_the_published_readings_give_the_published_stiffnesses():
    found = ec.calibrate(
        ec.datasets.fanuc_r2000ic(),
        springs="actuated",
        exclude=("0", "1", "10", "11", "12"),
        bounds=(float("-inf"), float("inf")),
        keep_blunders=True,
    )
    assert (1.0 / found.compliance).tolist() == pytest.approx(PUBLISHED, rel=1e-6)


def test_a_folder_that_holds_none_is_refused_with_where_they_are(tmp_path, monkeypatch):
    monkeypatch.setenv(datasets.DATA, str(tmp_path))
    with pytest.raises(FileAccessError, match=r"examples/fanuc_r2000ic.*ELASTOCAL_DATA"):
        ec.datasets.fanuc_r2000ic()


@pytest.mark.slow
def test_the_simulated_campaign_is_made_once(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path))
    found = ec.datasets.afp_simulated(seed=3, poses=4)
    assert len(found.poses) == 4
    assert found.marker_position.shape == (4, 3)
    monkeypatch.setattr(datasets, "_measure", None)
    again = ec.datasets.afp_simulated(seed=3, poses=4)
    assert (again.force == found.force).all()
    run = ec.datasets.afp_run(tmp_path / "afp", seed=3, poses=4)
    assert (ec.read_dataset(run / "dataset.nc").force == found.force).all()
    assert (tmp_path / "afp" / "plan" / "plan.json").is_file()
    with pytest.raises(FileAccessError, match="holds files already"):
        ec.datasets.afp_run(tmp_path / "afp", seed=3, poses=4)
