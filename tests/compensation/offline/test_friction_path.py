"""A path's rows share what friction remembers, block by block, and forget it in the air."""

from functools import cache

import numpy as np
import pytest

from elastocal.compensation.offline import CorrectionSettings, compensate_path, path_file
from elastocal.robot.inverse import inverse_for, joints_along_path
from elastocal.sim.arm.measurement import START
from support.geared import geared
from support.paths import FORCE_TCP, dome_course, force_columns, joint_columns, read_csv, write_csv

COUNT = 24
AXES = "xyz"
SHARES = np.concatenate([np.linspace(0.1, 1.0, 10), np.linspace(1.0, 0.3, 6), [0.0], [0.4] * 7])
"""Of the force, row by row: pressed, eased, through the air, pressed lightly."""


@cache
def programmed() -> tuple[np.ndarray, np.ndarray]:
    """Return joints of the course and the force on the robot in base."""
    T, solver = dome_course(COUNT), inverse_for(geared().model.robot)
    none = np.zeros((COUNT, 0))
    q = joints_along_path(solver, T, none, np.array(START), lambda row: f"row {row}")
    return q, SHARES[:, None] * (T[:, :3, :3] @ FORCE_TCP)


@pytest.fixture
def corrected(tmp_path):
    q, force = programmed()
    path = write_csv(tmp_path / "path.csv", joint_columns(q, "rad") | force_columns(force))

    def run() -> tuple[np.ndarray, np.ndarray]:
        compensate_path(geared(), path, tmp_path / "out.csv", CorrectionSettings())
        names = geared().model.robot.joint_names
        return (
            read_csv(tmp_path / "out.csv", *(f"{name}[rad]" for name in names)),
            read_csv(tmp_path / "out.csv", *(f"deflection_{axis}[m]" for axis in AXES)),
        )

    return run


def test_the_deflection_is_that_of_corrected_rows_one_after_the_other(corrected):
    q, deflection = corrected()
    _, force = programmed()
    visit = np.where(np.arange(COUNT) < 16, "press", "after the air")
    expected = geared().predict(q, force, None, visit).deflection
    np.testing.assert_allclose(deflection, expected, atol=1e-8)
    # Each row pressed from rest deflects otherwise where the force was eased.
    alone = geared().predict(q, force).deflection
    off = np.linalg.norm(deflection - alone, axis=1)
    assert off[10:16].max() > 1e-6
    assert off[0] < 1e-8


def test_the_loaded_tcp_is_where_it_was_programmed(corrected):
    q, deflection = corrected()
    wanted = dome_course(COUNT)[:, :3, 3]
    reached = geared().model.robot.forward(q)[:, :3, 3] + deflection
    np.testing.assert_allclose(reached, wanted, atol=1e-7)


def test_blocks_of_any_size_remember_alike(corrected, monkeypatch):
    whole = corrected()
    monkeypatch.setattr(path_file, "_ROWS_AT_A_TIME", 5)
    for found, expected in zip(corrected(), whole, strict=True):
        np.testing.assert_allclose(found, expected, atol=2e-9)
