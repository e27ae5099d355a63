"""What stands on a certificate is what was measured, whatever was planned."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal.procedure import Event
from elastocal.report.document.certificate import certificate_of_evidence
from elastocal.verdict import Evidence, fitted_readings, judge_evidence
from elastocal.wording import Phrase

PLANNED = {
    "load_cases": lambda cell: cell.file.load_cases.model_copy(
        update={"fz": 0.5 * cell.file.load_cases.fz, "fx": 3.0 * cell.file.load_cases.fx}
    ),
    "procedure": lambda cell: cell.file.procedure.model_copy(update={"conditioning": True}),
    "tool": lambda cell: cell.file.tool.model_copy(update={"mass": 3.0 * cell.file.tool.mass}),
    "certificate": lambda cell: cell.file.certificate.model_copy(update={"date": "1999-12-31"}),
    "engagement": lambda cell: cell.file.engagement.model_copy(update={"disk_radius": 0.5}),
    "search": lambda cell: cell.file.search.model_copy(update={"poses": 99}),
    "trackers": lambda _: (),
}
"""Every part of a cell file that says what is to be measured, and a value of another run."""


def _certificate(evidence):
    return certificate_of_evidence(evidence, judge_evidence(evidence))


def _texts(evidence):
    certificate, verdict = _certificate(evidence), judge_evidence(evidence)
    return certificate, verdict.meaning, verdict.sentence, verdict.reasons


@pytest.mark.parametrize("part", PLANNED)
def test_no_field_of_the_certificate_follows_the_plan(parts, part):
    cell = parts.cell
    other = replace(cell, file=cell.file.model_copy(update={part: PLANNED[part](cell)}))
    assert other.file != cell.file
    planned_otherwise = replace(parts, cell=other)
    assert _texts(planned_otherwise) == _texts(parts)


def test_a_plan_of_other_poses_changes_no_figure_of_the_certificate(parts):
    more = replace(parts.plan.poses[0], id=max(pose.id for pose in parts.plan.poses) + 1)
    other = replace(parts, plan=replace(parts.plan, poses=(*parts.plan.poses, more)))
    reasons = {"reasons": (), "more_reasons": None}
    found, before = _certificate(other), _certificate(parts)
    assert replace(found, **reasons) == replace(before, **reasons)
    assert "the run is partial" in found.reasons[0]


@pytest.fixture
def halved(parts):
    """Half of every force measured at every other pose, where the cell file asks for all of it."""
    xyz = parts.dataset.to_xarray().copy(deep=True)
    xyz["force"][::2] *= 0.5
    return replace(parts, dataset=type(parts.dataset).from_xarray(xyz))


def test_the_forces_are_those_of_the_readings_in_the_tcp_frame(halved):
    dataset, robot = halved.dataset, halved.calibrated.model.model.robot
    seen = []
    for pose in range(len(dataset.poses)):
        for case in range(len(dataset.load_cases)):
            if dataset.status[pose, case] == 0:
                R = robot.forward(dataset.joint_position[pose, case])[:3, :3]
                seen.append(R.T @ dataset.force[pose, case])
    press, aside = -np.array(seen)[:, 2], np.linalg.norm(np.array(seen)[:, :2], axis=1)
    rows = {str(name): parts for name, parts in _certificate(halved).identity}
    (tested,) = rows["Tested with"]
    assert tested == (
        f"{len(dataset.poses)} poses; {press.min():.0f} to {press.max():.0f} N pressing,"
        f" up to {aside.max():.0f} N sideways"
    )
    asked = min(-force[2] for force in halved.cell.file.presses.values())
    assert press.min() < 0.7 * asked


def test_a_pose_without_a_usable_reading_is_none_of_the_test(parts):
    xyz = parts.dataset.to_xarray().copy(deep=True)
    xyz["status"][0] = 1
    fewer = replace(parts, dataset=type(parts.dataset).from_xarray(xyz), reproduction=None)
    assert fitted_readings(fewer).sentence().startswith(f"{len(parts.dataset.poses) - 1} poses; ")


def test_forces_that_pull_are_not_said_to_press(parts):
    xyz = parts.dataset.to_xarray().copy(deep=True)
    xyz["force"] *= -1.0
    pulled = replace(parts, dataset=type(parts.dataset).from_xarray(xyz))
    assert "N pulling, up to" in fitted_readings(pulled).sentence()
    xyz["force"][0] *= -1.0
    both = replace(parts, dataset=type(parts.dataset).from_xarray(xyz))
    assert "N pulling to " in fitted_readings(both).sentence()


def test_readings_left_out_of_the_fit_are_not_in_the_picture_before(parts):
    unseen = parts.unseen
    first = unseen.pose == unseen.pose[0]
    kept = replace(
        unseen,
        error=unseen.error[~first],
        pose=unseen.pose[~first],
        load_case=tuple(np.array(unseen.load_case)[~first].tolist()),
    )
    fewer = replace(parts, reproduction=replace(parts.reproduction, unseen=kept))
    picture = _certificate(fewer).picture
    assert picture.before.count("M") == picture.after.count("M") == len(kept.error)


def test_the_robot_is_that_of_the_readings_and_another_cell_contradicts_them(parts):
    named = replace(parts.dataset, attributes={**parts.dataset.attributes, "robot_name": "other"})
    assert replace(parts, dataset=named).robot == "other"


def test_the_mass_of_the_tool_is_the_measured_one_and_else_said_to_be_stated(parts):
    def mass(evidence):
        return [
            each
            for name, found in _certificate(evidence).identity
            if name == "Tool"
            for each in found
        ]

    assert f"{parts.tool.mass:.1f} kg, measured" in mass(parts)
    weighed = parts.summary.tool.mass_kg.value
    assert f"{weighed:.1f} kg, measured" in mass(replace(parts, tool=None))
    stated = replace(parts, tool=None, summary=None)
    assert f"{parts.cell.file.tool.mass:g} kg by the cell file" in mass(stated)


def test_the_worst_reading_is_named_with_its_measured_force(halved):
    unseen, tested = halved.unseen, fitted_readings(halved)
    k = int(unseen.error.argmax())
    tight = replace(halved, limits=replace(halved.limits, tolerance=0.99 * unseen.max))
    x, y, z = tested.forces[int(unseen.pose[k]), unseen.load_case[k]]
    place = f"({-z:.0f} N pressing, {np.hypot(x, y):.0f} N sideways)"
    assert any(place in reason for reason in judge_evidence(tight).reasons)


def test_the_date_is_that_of_the_run_and_another_one_is_told(parts):
    other = replace(parts, stated={"date": "1999-12-31"})
    assert "1999" not in str(_certificate(other).identity)
    assert any("1999-12-31" in note for note in judge_evidence(other).notes)
    imported = replace(other, journal=None)
    assert "1999-12-31" in str(_certificate(imported).identity)


def test_without_readings_nothing_is_said_to_be_tested(parts):
    assert fitted_readings(Evidence(made=parts.made)) is None
    nothing = replace(parts, dataset=None, reproduction=None)
    assert "Tested with" not in {str(name) for name, _ in _certificate(nothing).identity}
    assert "Tested with" in _certificate(nothing).not_entered
    assert isinstance(_certificate(nothing).not_entered, Phrase)


def test_a_run_that_had_enough_poses_is_not_partial(parts):
    more = replace(parts.plan.poses[0], id=max(pose.id for pose in parts.plan.poses) + 1)
    last = parts.journal[-1]
    enough = last.model_copy(update={"event": Event.ENOUGH, "text": "accurate enough"})
    other = replace(
        parts,
        plan=replace(parts.plan, poses=(*parts.plan.poses, more)),
        journal=(*parts.journal, enough, last),
    )
    verdict = judge_evidence(other)
    assert not any("partial" in reason for reason in verdict.reasons)
    assert any("which was enough: accurate enough" in note for note in verdict.notes)
