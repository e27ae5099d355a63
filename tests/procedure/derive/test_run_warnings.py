from dataclasses import replace

import numpy as np
import pytest

from elastocal.cell import SensorLoad
from elastocal.procedure.derive import LoadRow
from elastocal.procedure.derive.derivation import run_warnings
from elastocal.procedure.derive.tool import Interval, ToolChange, ToolEstimate
from elastocal.procedure.record import ReadingStatus
from elastocal.procedure.registration import Blunder, Registration, StationFit
from elastocal.procedure.registration.register import StationMove

TOOL = SensorLoad(60.0, np.array([0.0, 0.0, 0.15]), gravity=np.array([0.0, 0.0, -9.8]))
SMALL = Interval(np.zeros(3), np.ones(3))
ESTIMATE = ToolEstimate(
    count=31,
    mass=Interval(np.array(59.0), np.array(0.5)),
    centre=Interval(np.array([0.0, 0.001, 0.149]), np.full(3, 0.002)),
    force_bias=SMALL,
    moment_bias=SMALL,
    force_drift=SMALL,
    moment_drift=SMALL,
    force_scatter=0.5,
    moment_scatter=0.05,
    undetermined=(),
)
FIT = StationFit("A", (0, 1, 2), np.eye(4), 3e-4, np.full(3, 1e-4), np.zeros((3, 3)), 1e-3)
LEVER = np.array([0.11, 0.0, -0.09])
REGISTRATION = Registration(
    (FIT,), LEVER, np.full(3, 1e-4), LEVER + 1e-3, (), 4e-5, 2e-4, (), (), {}
)
ROWS = [LoadRow(0, "normal", ReadingStatus.OK, "", None)]


def warnings(**changes: object) -> list[str]:
    given = {"rows": ROWS, "registration": REGISTRATION, "tool": TOOL, "estimate": ESTIMATE}
    return run_warnings(**(given | changes), load_cases=("normal",), weighed=(4, 7, 9))


def test_a_step_of_the_tool_weight_is_told_in_place_of_a_wrong_mass():
    changed = replace(mass(80.0, 9.0), change=ToolChange(1, 20.0))
    (line,) = warnings(estimate=changed)
    assert line.startswith("the tool weight changed near pose 7, by about +20.0 kg")


def mass(value: float, half: float) -> ToolEstimate:
    return replace(ESTIMATE, mass=Interval(np.array(value), np.array(half)))


def test_a_run_without_a_fault_has_none():
    assert warnings() == []


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"moves": (StationMove("A", 16, 17, 3.1e-4, 2e-5, 2e-4, -6.2),)},
            "station A moved between poses 16 and 17: the marker seemed to jump by 0.31 ±"
            " 0.04 mm, the station turned by 0.20 mrad; scatter and errors of the arm look like"
            " this in one run of 10^6; both stretches are registered by themselves",
        ),
        (
            {"blunders": (Blunder(9, "A", 0.5),)},
            "pose 9: the unloaded marker reading of station A is 500.00 mm off: its displacements"
            " are doubtful",
        ),
        (
            {"unregistered": {"B": "it saw 2 poses"}},
            "station B is not registered, its readings are missing: it saw 2 poses",
        ),
        (
            {"undetermined_lever": ("x", "z")},
            "the orientations of the poses are too similar to tell the lever arm of the marker"
            " along x, z of the tcp: there it is the cell file's",
        ),
        (
            {"lever_prior": LEVER + np.array([0.0, 0.02, 0.0])},
            "the marker is 20.0 mm from where the cell file has it (110.0 mm, 0.0 mm, -90.0 mm in"
            " the tcp frame)",
        ),
        (
            {"stations": (replace(FIT, rotation_sigma=8e-3),)},
            "station A: its rotation is known to 8.0 mrad only, an error of 8.0 µm for each mm of"
            " displacement",
        ),
    ],
)
def test_what_is_odd_about_the_stations_is_told(changes, said):
    assert warnings(registration=replace(REGISTRATION, **changes)) == [said]


@pytest.mark.parametrize(
    ("estimate", "said"),
    [
        (
            mass(75.0, 0.5),
            "the tool weighs 75.0 ± 0.5 kg by 31 unloaded references, 60.0 kg by the cell file",
        ),
        (
            mass(0.3, 0.5),
            "the sensor shows 0.3 ± 0.5 kg of the tool's 60.0 kg: it seems to take the tool weight"
            " away itself",
        ),
        (
            replace(ESTIMATE, centre=Interval(np.array([0.0, 0.1, 0.15]), np.full(3, 0.01))),
            "the tool's centre of mass is 100 mm along y of the sensor from where the cell file has"
            " it",
        ),
    ],
)
def test_a_tool_that_is_not_the_cells_is_told(estimate, said):
    assert warnings(estimate=estimate) == [said]


@pytest.mark.parametrize("estimate", [mass(70.0, 15.0), mass(np.nan, np.nan)])
def test_an_estimate_that_is_too_vague_accuses_nobody(estimate):
    assert warnings(estimate=estimate) == []
