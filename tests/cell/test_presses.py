"""What is pressed at a pose, in order in time: levels, the check, the reference."""

import numpy as np
import pytest

from elastocal.cell import CONDITIONING, LIGHT_CONTACT, fingerprint
from elastocal.errors import SchemaError
from support.simulated import example_cell

LOADS = {"fx": "280 N", "fy": "280 N", "fz": "1100 N", "friction": 0.5}
REFERENCE = {"reference": "light_contact", "conditioning": True}
FULL = ("normal", "north", "south", "east", "west")


def cell(loads=None, procedure=None):
    return example_cell(load_cases=LOADS | (loads or {}), procedure=procedure or {})


def test_a_file_without_the_keys_presses_its_cases_alone():
    assert tuple(cell().file.presses) == FULL


def test_the_load_comes_up_to_the_full_cases_and_goes_down_from_them():
    presses = cell({"level": 0.45, "check": 0.75}).file.presses
    assert tuple(presses) == ("normal_45", *FULL, "normal_75", "normal_45_back")
    np.testing.assert_allclose(presses["normal_45"], [0.0, 0.0, -495.0])
    np.testing.assert_allclose(presses["normal_75"], [0.0, 0.0, -825.0])


def test_the_conditioning_press_goes_before_the_light_contact():
    presses = cell(procedure=REFERENCE).file.presses
    assert tuple(presses) == (CONDITIONING, LIGHT_CONTACT, *FULL)
    np.testing.assert_allclose(presses[CONDITIONING], [0.0, 0.0, -1100.0])
    np.testing.assert_allclose(presses[LIGHT_CONTACT], [0.0, 0.0, -60.0])


def test_levels_change_the_fingerprint_and_the_reference_does_not():
    """The procedure says how a plan is carried out; load cases are part of what is planned."""
    assert fingerprint(cell()) == fingerprint(cell(procedure=REFERENCE))
    assert fingerprint(cell()) != fingerprint(cell({"level": 0.45}))


@pytest.mark.parametrize(
    ("loads", "procedure", "message"),
    [
        ({}, {"conditioning": True}, "conditioning: needs reference: light_contact"),
        ({"level": 0.45, "check": 0.45}, {}, "must differ from level"),
        ({"level": 0.455}, {}, "whole percent of the full load"),
        ({"level": 1.2}, {}, "level"),
        ({"check": 0.0}, {}, "check"),
        ({}, {"reference": "touching"}, "reference"),
    ],
)
def test_what_makes_no_sense_is_refused_by_name(loads, procedure, message):
    with pytest.raises(SchemaError, match=message):
        cell(loads, procedure)
