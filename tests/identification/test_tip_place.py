"""The place of a tip that is not where the description has it, found beside the springs."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import elastocal as ec
from elastocal.errors import IdentificationError
from elastocal.identification import Contact, FitOptions, read_contact, with_tip_found
from elastocal.robot import Robot, fixed_joint_of, with_joint_origins
from support.held import Held, held_by_contact, robot

WRONG = np.array([5e-3, -4e-3, 6e-3])
NOISY = Held(noise=5e-6)
KNOWN = Contact(normal=NOISY.normal, lateral=NOISY.lateral, uncertainty=0.1, tip=5e-3)


def described(by: np.ndarray) -> Robot:
    """Return the arm with its tcp beside the true one, weightless as the truth."""
    T = np.eye(4)
    T[:3, 3] = by
    joint = fixed_joint_of(robot().urdf, "tcp")
    made = Robot.from_urdf(with_joint_origins(robot().urdf, {joint: T}), "tcp")
    return replace(made, gravity=(0.0, 0.0, 0.0))


@cache
def found(how: Held = NOISY):
    readings = held_by_contact(how).readings(robot().joint_names)
    return with_tip_found(described(WRONG), readings, FitOptions(contact=KNOWN))


def test_the_place_across_the_normal_is_found_within_its_error():
    tip = found()[1].contact.tip_found
    missed = np.array(tip.place) + WRONG
    assert np.all(np.abs(missed[:2]) < np.minimum(1e-3, 4.0 * np.array(tip.sigma[:2])))
    assert max(tip.sigma) < KNOWN.tip
    assert all(0.0 < each <= 1.0 for each in tip.outside)


def test_the_robot_has_its_tcp_where_the_tip_was_found():
    moved, options = found()
    q = np.full(6, 0.3)
    T_old, T_new = described(WRONG).forward(q), moved.forward(q)
    shift = T_old[:3, :3].T @ (T_new - T_old)[:3, 3]
    np.testing.assert_allclose(shift, options.contact.tip_found.place, atol=1e-8)
    np.testing.assert_allclose(T_new[:3, :3], T_old[:3, :3], atol=1e-8)


def test_without_a_width_the_place_is_exact():
    readings = held_by_contact(NOISY).readings(robot().joint_names)
    exact, arm = FitOptions(contact=replace(KNOWN, tip=None)), described(WRONG)
    assert with_tip_found(arm, readings, exact) == (arm, exact)


def test_calibrate_says_where_the_tip_is():
    data = held_by_contact(NOISY)
    off = replace(data, attributes={**data.attributes, "robot_urdf": described(WRONG).urdf})
    result = ec.calibrate(off, contact=KNOWN, springs="actuated", draws=40)
    contact = result.calibration.contact
    np.testing.assert_allclose(np.array(contact.tip.place)[:2], -WRONG[:2], atol=1e-3)
    assert "The tip lies beside the stated tcp by" in str(contact.tip.sentence())


def test_a_tracked_pose_is_refused_with_it():
    readings = held_by_contact(Held(tracked=3)).readings(robot().joint_names)
    with pytest.raises(IdentificationError, match=r"leave contact\.tip out"):
        with_tip_found(described(WRONG), readings, FitOptions(contact=KNOWN))


def test_a_contact_file_states_the_width(tmp_path):
    path = tmp_path / "contact.yaml"
    path.write_text('contact: {normal: "50 N/um", tip: "5 mm"}\n')
    assert read_contact(path) == Contact(normal=50e6, tip=5e-3)
    with pytest.raises(IdentificationError, match=r"contact\.tip is 0\.2: it must be above 0"):
        Contact(tip=0.2)
