"""Sections `simulation` and `faults` of the cell file."""

import pytest

from elastocal.errors import SchemaError
from support.simulated import example_cell


def refusal(**sections):
    with pytest.raises(SchemaError) as caught:
        example_cell(**sections)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_a_cell_without_the_sections_has_defaults_and_no_faults():
    file = example_cell().file
    assert file.simulation.seed == 0
    assert file.simulation.truth.gears == 1.0
    assert file.faults == ()


def test_quantities_arrive_in_si():
    entry = example_cell(
        simulation={
            "gears": {"backlash": "0.01 deg", "stiffness": ["2e6 N*m/rad"] * 6},
            "contact": {"normal_stiffness": "4 N/um", "slide_speed": "5 mm/s"},
            "sensor": {"rate": "250 Hz", "moment_noise": "0.2 N*m"},
        }
    ).file.simulation
    assert entry.gears.backlash == pytest.approx(1.745e-4, rel=1e-3)
    assert entry.gears.stiffness == (2e6,) * 6
    assert entry.contact.normal_stiffness == pytest.approx(4e6)
    assert entry.contact.slide_speed == pytest.approx(5e-3)
    assert entry.sensor.rate == 250.0


@pytest.mark.parametrize(
    ("simulation", "message"),
    [
        ({"truht": {}}, "did you mean 'simulation.truth'|did you mean 'truth'"),
        ({"truth": {"gear": 2.0}}, "did you mean 'gears'"),
        ({"truth": {"gears": 0.0}}, "greater than 0"),
        ({"contact": {"normal_stiffness": 4e6}}, "translational stiffness with its unit"),
        ({"gears": {"stiffness": ["1e6 N*m/rad"] * 5}}, "at least 6"),
        ({"sensor": {"rate": "0 Hz"}}, "greater than or equal to 1"),
        ({"sensor": {"force_noise": "1 mm"}}, "not a force"),
        ({"controller": {"gravity_compensation": 1.1}}, "less than or equal to 1"),
        ({"balancer": {"lever": "0.7 m"}}, "must be below anchor"),
        ({"seed": -1}, "greater than or equal to 0"),
    ],
)
def test_what_makes_no_sense_is_refused_by_its_path(simulation, message):
    import re

    assert re.search(message, refusal(simulation=simulation))


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ({"kind": "beam_brake", "pose": 0}, "beam_break"),
        ({"kind": "slip"}, "pose' is missing"),
        ({"kind": "slip", "pose": -1}, "greater than or equal to 0"),
        ({"kind": "slip", "pose": 0, "duration": "1 s"}, "'duration' means nothing for slip"),
        ({"kind": "contact_missed", "pose": 0, "after": "1 s"}, "its keys: none"),
        ({"kind": "beam_break", "pose": 0, "duration": 2}, "time with its unit"),
        ({"kind": "beam_break", "pose": 0, "stap": "hold"}, "did you mean 'step'"),
        ({"kind": "robot_stop", "pose": 0, "step": "holding"}, "'hold'"),
    ],
)
def test_a_fault_that_makes_no_sense_is_refused(fault, message):
    text = refusal(faults=[fault])
    assert message in text
    assert "faults.0" in text
