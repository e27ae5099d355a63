"""A disk that fills while a run records: what is recorded stays, and the run goes on later."""

import shutil
import subprocess
import sys

import numpy as np
import pytest

from elastocal.dataset import read_dataset
from support.run_cells import planned_cell

MOUNT = 'mount -t tmpfs -o size=1100k none "$0"'
RUN = '"$1" -c "from elastocal.cli.main import run; run()" run "$2" --plan "$3" --out "$0/run"'
SCRIPT = f"""
{MOUNT} || exit 77
{RUN}; echo "first $?"
ls -A "$0/run/streams"
mount -o remount,size=50m "$0"
{RUN} --resume --yes; echo "second $?"
cp "$0/run/dataset.nc" "$4"
"""
"""A pose takes some 400 kB: the disk has room for two of three."""


@pytest.mark.slow
def test_a_run_whose_disk_is_full_goes_on_when_there_is_room(tmp_path):
    if shutil.which("unshare") is None:
        pytest.skip("unshare is not on this machine")
    disk, result = tmp_path / "disk", tmp_path / "dataset.nc"
    disk.mkdir()
    cell = planned_cell(tmp_path, 3)
    command = ["unshare", "-rm", "sh", "-c", SCRIPT, disk, sys.executable, cell.cell, cell.plan]
    paths = {"PYTHONPATH": ":".join(path for path in sys.path if path)}
    done = subprocess.run(
        [*command, result], env=paths, capture_output=True, text=True, check=False
    )
    if "first" not in done.stdout:
        pytest.skip(f"this machine lets nobody mount a tmpfs of his own: {done.stderr}")
    streams = ["pose_0000_1.mcap", "pose_0001_1.mcap"]
    assert done.stdout.split() == ["first", "1", *streams, "second", "0"], done.stderr
    refusals = [line for line in done.stderr.splitlines() if line.startswith("elastocal:")]
    assert len(refusals) == 1
    assert "pose_0002_1.mcap: No space left on device. The arm is retracted" in refusals[0]
    assert "Traceback" not in done.stderr
    data = read_dataset(result)
    assert np.isfinite(data.marker_displacement).all()
    assert data.marker_displacement.shape[0] == 3
