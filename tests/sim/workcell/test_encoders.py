"""Secondary encoders of a simulated arm: truth, noise, and what a run keeps of them."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal.cell import load_cell
from elastocal.cell.examples import write_example
from elastocal.compensation import CompensatorSettings
from elastocal.errors import CompensationError
from elastocal.sim.truth import EncoderTruth, truth_of
from elastocal.sim.workcell import LinkEncoders, ProcessCell, simulated_devices
from elastocal.workflows.simulate_process import with_encoders


@pytest.fixture(scope="module")
def cells(tmp_path_factory):
    """Return an example cell without encoders, and one with them."""
    plain = load_cell(write_example(tmp_path_factory.mktemp("afp"), "afp")[0])
    truth = truth_of(plain).model_copy(update={"encoders": EncoderTruth(noise="2e-6 rad")})
    file = plain.file.model_copy(update={"simulation": truth})
    return plain, replace(plain, file=file)


def test_an_arm_without_encoders_shows_no_links(cells):
    plain, _ = cells
    assert LinkEncoders.of(plain) is None
    assert simulated_devices(plain, 0).arm.state().link is None
    assert ProcessCell(plain, 0).read_links(np.zeros((1, 7)), np.zeros((1, 7))) is None
    with pytest.raises(CompensationError, match="has no secondary encoders"):
        with_encoders(CompensatorSettings(), plain)


def test_links_hang_where_their_gears_yield_under_the_weight_of_the_arm(cells):
    _, cell = cells
    state = simulated_devices(cell, 0).arm.state()
    external = cell.robot.external_axes
    assert np.all(np.isnan(state.link[:external]))
    apart = (state.link - state.q)[external:]
    assert 1e-5 < np.abs(apart).max() < 3e-3


def test_a_load_moves_them_by_what_the_gears_yield(cells):
    _, cell = cells
    truth, q = ProcessCell(cell, 0), cell.home[None]
    truth.lift(["a course"], q)
    still = truth.press(q, np.zeros((1, 3)))
    loaded = truth.press(q, np.array([[0.0, 0.0, 1000.0]]))
    yielded = (loaded.gears - still.gears)[0, cell.robot.external_axes :]
    assert 1e-5 < np.abs(yielded).max() < 5e-3
    seen = [truth.read_links(q, each.gears)[0] for each in (still, loaded)]
    np.testing.assert_allclose(seen[1] - seen[0], yielded, atol=2e-5)


def test_the_error_once_a_turn_is_that_of_the_cell(cells):
    _, cell = cells
    encoders = LinkEncoders.of(cell)
    q = np.linspace(-np.pi, np.pi, 400)[:, None] * np.ones(6)
    wobble = encoders.read(q, np.zeros_like(q), np.zeros_like(q)) - q
    np.testing.assert_allclose(np.abs(wobble).max(axis=0), 2e-5, rtol=1e-3)
    assert encoders.scatter(1.0) == pytest.approx(2e-6 / np.sqrt(250.0))
