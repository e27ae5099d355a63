"""Quick readings against the devices that are stepped through time."""

from functools import cache

import numpy as np
import pytest

from elastocal.cell.devices import Motion
from elastocal.elastic import ElasticModel, layout
from elastocal.identification import build, solve
from elastocal.sim.workcell import (
    CampaignErrors,
    CampaignSimulator,
    ContactPoses,
    ErrorDraws,
    ErrorScales,
)
from elastocal.sim.workcell._instruments import _draw, force_gain
from elastocal.sim.workcell._timeline import generator
from elastocal.sim.workcell.campaign import TrueReadings
from support.simulated import QUIET, Session, example_cell, marker_by_controller, places

NANOMETRE = 1e-9


def where(like):
    found = places(like, 3)
    return ContactPoses(np.array([p.q for p in found]), np.array([p.normal for p in found]))


@cache
def settled(like="afp") -> TrueReadings:
    cell = example_cell(like, simulation=QUIET)
    return CampaignSimulator.of(cell).settle(where(like), cell.file.load_cases.force_tcp)


@pytest.mark.slow
@pytest.mark.parametrize("like", ["afp", "machining"])
def test_quick_readings_are_those_of_the_devices(like):
    cell, quick = example_cell(like, simulation=QUIET), settled(like)
    place = places(like, 3)[1]
    session = Session.of(cell)
    state = session.near(place)
    tare, marker_0 = session.average()
    by_controller_0 = marker_by_controller(state, cell)
    assert session.touch(place).motion is Motion.IDLE
    for load, force in enumerate(cell.file.load_cases.force_tcp):
        state = session.hold(force)
        wrench, marker = session.average()
        deflection = marker - marker_0 - (marker_by_controller(state, cell) - by_controller_0)
        ours = quick.marker_displacement[1, load] - quick.controller_displacement[1, load]
        np.testing.assert_allclose(ours, deflection, atol=20 * NANOMETRE)
        np.testing.assert_allclose(quick.felt[1, load], (wrench - tare)[:3], atol=0.05)
        np.testing.assert_allclose(quick.q[1, load], state.q, atol=5e-6)


PRESSES = np.array(
    [[0.0, 0.0, -1100.0], [0.0, 0.0, -60.0], [0.0, 0.0, -495.0], [280.0, 0.0, -1100.0]]
)
"""Conditioning, light contact, a level, north."""


def test_quick_readings_after_conditioning_count_from_the_light_contact_as_the_devices_do():
    cell, place = example_cell("afp", simulation=QUIET), places("afp", 3)[1]
    quick = CampaignSimulator.of(cell).settle(where("afp"), PRESSES, reference=1)
    session = Session.of(cell)
    session.near(place)
    tare, _ = session.average()
    session.touch(place)
    seen = []
    for force in PRESSES:
        state = session.hold(force)
        wrench, marker = session.average()
        seen.append((marker - marker_by_controller(state, cell), (wrench - tare)[:3], state.q))
    zero = seen.pop(1)
    np.testing.assert_allclose(quick.reference_q[1], zero[2], atol=5e-6)
    np.testing.assert_allclose(quick.reference_felt[1], zero[1], atol=0.05)
    for load, (deflection, felt, _) in enumerate(seen):
        ours = quick.marker_displacement[1, load] - quick.controller_displacement[1, load]
        np.testing.assert_allclose(ours, deflection - zero[0], atol=20 * NANOMETRE)
        np.testing.assert_allclose(quick.felt[1, load], felt, atol=0.05)


def test_a_full_press_before_the_reference_changes_what_a_low_one_shows():
    """Friction keeps a part of it: the level after it is reached from above, not from rest."""
    quick = CampaignSimulator.of(example_cell("afp", simulation=QUIET | {"preset": "typical"}))
    after = quick.settle(where("afp"), PRESSES, reference=1)
    without = quick.settle(where("afp"), PRESSES[1:], reference=0)
    gap = (after.marker_displacement - after.controller_displacement)[:, 1] - (
        without.marker_displacement - without.controller_displacement
    )[:, 0]
    assert np.linalg.norm(gap, axis=1).max() > 20e-6


def test_light_contact_gives_the_springs_of_an_unloaded_reference_where_nothing_sticks():
    still = {"gears": {"backlash": "0 rad", "hysteresis": 0.0, "growth": 0.0}}
    still |= {"balancer": {"fitted": False}, "controller": QUIET["controller"]}
    cell, loads = example_cell("afp", simulation=QUIET | still), None
    quick, errors = CampaignSimulator.of(cell), CampaignErrors.of(cell)
    marker, found = np.array(cell.file.marker.position_tcp), []
    poses = ContactPoses(*(np.array(each) for each in zip(*_poses(12), strict=True)))
    for presses, reference in ((PRESSES[2:], None), (PRESSES[1:], 0)):
        settled = quick.settle(poses, presses, reference=reference)
        draws = ErrorDraws.of(12, 2, np.random.default_rng(0))
        readings = errors.readings(
            settled, draws, ErrorScales(0.0, 0.0), np.zeros((12, 3)), ("level", "north")
        )
        model = ElasticModel(cell.robot, layout(cell.robot, "actuated"))
        compliance = solve(build(model, readings, None, marker)).compliance
        loads = loads or readings
        found.append(model.deflection(compliance, loads.joint_position, loads.force))
    gap = np.linalg.norm(found[1] - found[0], axis=1)
    assert gap.max() < 0.01 * np.linalg.norm(found[0], axis=1).max()


def _poses(count):
    return [(place.q, place.normal) for place in places("afp", count)]


def test_gears_remember_the_load_cases_before():
    cell = example_cell("afp", simulation=QUIET)
    forces = cell.file.load_cases.force_tcp
    alone = CampaignSimulator.of(cell).settle(where("afp"), forces[2:3])
    gap = np.abs(alone.deflection[:, 0] - settled().deflection[:, 2]).max()
    assert 1e-7 < gap < 1e-4


def test_a_place_does_not_depend_on_the_places_beside_it():
    cell, all_places = example_cell("afp", simulation=QUIET), where("afp")
    one = ContactPoses(all_places.q[1:2], all_places.normal[1:2])
    alone = CampaignSimulator.of(cell).settle(one, cell.file.load_cases.force_tcp)
    np.testing.assert_allclose(alone.deflection[0], settled().deflection[1], atol=2 * NANOMETRE)


def test_an_arm_twice_as_stiff_deflects_half():
    cell = example_cell("afp", simulation=QUIET | {"balancer": {"fitted": False}})
    quick = CampaignSimulator.of(cell)
    soft = quick.settle(where("afp"), cell.file.load_cases.force_tcp)
    stiff = quick.stiffened(np.full(quick.springs, 2.0)).settle(
        where("afp"), cell.file.load_cases.force_tcp
    )
    ratio = np.linalg.norm(stiff.deflection, axis=2) / np.linalg.norm(soft.deflection, axis=2)
    # Gears are softer near rest, so a little more than half.
    assert np.all((ratio > 0.48) & (ratio < 0.6))


def test_without_errors_the_readings_are_the_truth():
    cell, quick = example_cell("afp"), settled()
    draws = ErrorDraws.of(3, 5, np.random.default_rng(0))
    still = example_cell("afp", simulation={"controller": {"repeatability": "0 um"}})
    readings = CampaignErrors.of(still).readings(
        quick, draws, ErrorScales(0.0, 0.0), np.zeros((3, 3)), cell.file.load_cases.cases
    )
    np.testing.assert_array_equal(
        readings.marker_displacement.reshape(3, 5, 3), quick.marker_displacement
    )
    # What is left is the turn of the sensor, which the controller does not know.
    assert np.abs(readings.force.reshape(3, 5, 3) - quick.force).max() < 1.5


def test_errors_have_the_size_that_the_cell_file_gives_their_averages():
    cell, quick = example_cell("afp"), settled()
    many, rng = 2000, np.random.default_rng(1)
    errors = CampaignErrors.of(cell)
    one = {name: np.repeat(getattr(quick, name)[:1], many, axis=0) for name in vars(quick)}
    quick = TrueReadings(**one)
    station = np.repeat(quick.marker[:1] + np.array([3.0, 0.0, 0.0]), many, axis=0)
    draws = ErrorDraws.of(many, 5, rng)
    found = errors.readings(
        quick, draws, ErrorScales(2.0, 0.0), station, cell.file.load_cases.cases
    )
    error = found.marker_displacement.reshape(many, 5, 3) - quick.marker_displacement
    sample = 2.0 * (15e-6 + 3 * 6e-6) / 1.96
    averaged = sample * averaged_noise(cell)
    expected = np.sqrt(2.0) * np.hypot(averaged, 10e-6)
    np.testing.assert_allclose(error.std(axis=0), expected, rtol=0.08)


def averaged_noise(cell):
    """Standard deviation of an average over a second of the tracker's unit noise."""
    tracker = cell.file.simulation.tracker
    draw = _draw(tracker.turbulence, tracker.rate)
    count = round(cell.file.procedure.average * tracker.rate)
    blocks = [draw(np.random.default_rng(seed)) for seed in range(600)]
    return np.std([block[200 : 200 + count].mean(axis=0) for block in blocks])


def test_cross_talk_is_that_of_the_simulated_sensor():
    cell, seed = example_cell("afp"), 3
    talk = generator(seed, "sensor", "cross-talk").standard_normal((6, 6))
    gain = np.eye(3) + np.einsum("ijkl,kl->ij", CampaignErrors.of(cell).gain, talk)
    np.testing.assert_allclose(gain, force_gain(cell, seed).force, atol=1e-12)


def test_a_part_of_the_draws_is_drawn_as_in_the_whole():
    draws = ErrorDraws.of(10, 5, np.random.default_rng(0))
    part = draws.take(np.array([7, 2]), np.array([0, 3]))
    np.testing.assert_array_equal(part.marker[0], draws.marker[7][[0, 1, 4]])
    np.testing.assert_array_equal(part.drift, draws.drift[[7, 2]])
