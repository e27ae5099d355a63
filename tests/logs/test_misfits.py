"""How badly one arm explains a log, where the log has nothing to explain."""

from types import SimpleNamespace

import numpy as np

from elastocal.logs._misfits import weight_misfit


def swinging(force):
    """Return an arm that turns its tool, and a sensor that reads a force at each of its times."""
    time = 0.01 * np.arange(len(force))
    angle = np.sin(time)
    T = np.tile(np.eye(4), (len(time), 1, 1))
    T[:, 1, 1] = T[:, 2, 2] = np.cos(angle)
    T[:, 2, 1], T[:, 1, 2] = np.sin(angle), -np.sin(angle)
    T[:, 0, 3] = time
    arm = SimpleNamespace(time=time, T_base_tcp=T)
    wrench = SimpleNamespace(time=time, force=force)
    return SimpleNamespace(wrench=wrench), SimpleNamespace(arm=arm), T


def test_forces_that_are_no_numbers_explain_nothing():
    log, reference, _ = swinging(np.full((1000, 3), np.nan))
    assert weight_misfit(log, reference, 0.0) == np.inf


def test_a_weight_is_explained_whatever_readings_are_missing():
    log, reference, T = swinging(np.zeros((1000, 3)))
    log.wrench.force = 100.0 * T[:, 2, :3] + 3.0
    log.wrench.force[::3] = np.nan
    assert weight_misfit(log, reference, 0.0) < 1e-9
    assert weight_misfit(log, reference, 0.5) > 0.1
