"""The C of an arm with secondary encoders is Python's, to the last digits."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal.cell import SensorLoad
from elastocal.compensation import CompensatorSettings
from elastocal.compensation.export.writer import c_files
from elastocal.compensation.online import Compensator, Reading
from elastocal.compensation.process.loop import CycleInput
from elastocal.identification import EncoderZero
from elastocal.robot import Robot
from support.by_day import some_by_day
from support.compensated import calibrated
from support.compiled import CompiledCorrector
from support.exported import needs_gcc
from support.geared import geared
from support.virtual_chain import ARMS


def compensator(remembers: bool, joints: slice = slice(1, 3)) -> Compensator:
    model = geared() if remembers else calibrated(Robot.from_urdf(ARMS["six axes"], "tcp"))
    zeros = tuple(
        EncoderZero(name, 1e-3 * k, 4e-7, 2e-4, -1e-4, 2e-5)
        for k, name in enumerate(model.model.robot.joint_names, start=1)
    )
    model = replace(model, encoders=zeros)
    settings = CompensatorSettings(
        encoders={"joints": model.model.robot.joint_names[joints], "average": "20 ms"},
        uncertain_above="5 mm",
    )
    return Compensator.of(model, settings, SensorLoad())


@needs_gcc
@pytest.mark.parametrize("remembers", some_by_day([True, False]))
def test_the_c_follows_encoders_as_python_does(remembers, tmp_path):
    python = compensator(remembers)
    there, state = CompiledCorrector(python, tmp_path), python.start()
    rng, q = np.random.default_rng(0), np.array([0.2, -1.1, 1.3, 0.4, -0.6, 0.3])
    for step in range(400):
        time = np.array([0.004 * step])
        q = q + 1e-4 * rng.standard_normal(6)
        force = 900.0 * np.sin(0.02 * step) * np.array([0.1, 0.2, -1.0, 0.0, 0.0, 0.0])
        links = None if step % 50 == 7 else q[1:3] + 1e-3 + 1e-4 * rng.standard_normal(2)
        if links is not None and step % 40 == 9:
            links[1] += 0.01  # a lost count
        there.correct(CycleInput(time, q, force[None], np.zeros(3), links))
        reading = Reading(time[0], q.tolist(), force[:3].tolist(), force[3:].tolist())
        state = python.condition(state, reading)
        state, here = python.correct(state, q.tolist(), None if links is None else links.tolist())
        told = (*here.correction, *here.deflection, here.half_width, here.status)
        np.testing.assert_allclose(there.told, told, rtol=1e-9, atol=1e-14)
        if step in (60, 300):
            there.zero_encoders()
            state = python.zero_encoders(state)
    assert state.zero


@pytest.mark.parametrize("remembers", some_by_day([False, True]))
def test_without_encoders_nothing_of_them_is_in_the_c(remembers):
    made = compensator(remembers, slice(0, 0))
    assert not [name for name, text in c_files(made.design).items() if "ncoder" in text]
