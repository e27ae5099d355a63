"""What the sections say: the numbers of the files, and what is odd about them."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from elastocal.cell import Limits
from elastocal.compensation.process import PAPER
from elastocal.identification import CalibrationSummary, SpringUpdate, describe
from elastocal.procedure import Event, RunSummary
from elastocal.procedure.derive.derivation import MOVED
from elastocal.records import from_data, to_data
from elastocal.report.document.page import ordered_sections
from elastocal.report.document.sections.cell import _LIMITS, _tool_file
from elastocal.verdict import Link, LinkState
from elastocal.verdict.chain import ChainFiles, verify_chain
from elastocal.verdict.evidence import MissingPart, Seal, UsedFile
from elastocal.verdict.findings import (
    codec_findings,
    compliance_findings,
    instrument_findings,
    missing_findings,
    process_findings,
    reading_findings,
)

(
    in_full, uncertainty, cell, poses, readings, instruments, compliances, codecs, process, _,
    provenance, not_verified,
) = ordered_sections()  # fmt: skip


def words(section, parts):
    """Return the text of a section, without tags."""
    html = section.body(parts).html
    return " ".join(re.sub(r"<[^>]*>", "", html.replace("<", " <")).split())


def findings(found, parts, holds_back=True):
    return [each for each in found(parts) if each.holds_back is holds_back]


def with_figures(parts, **changes):
    data = to_data(parts.calibrated.figures) | changes
    figures = from_data(CalibrationSummary, data, "figures")
    return replace(parts, calibrated=replace(parts.calibrated, figures=figures))


def with_summary(parts, **changes):
    data = to_data(parts.summary) | changes
    return replace(parts, summary=from_data(RunSummary, data, "summary"))


SUSPICIOUS = {
    "pose": 3, "load_case": "north", "score": 9.5, "residual": 0.4e-3, "leverage": 0.2,
}  # fmt: skip


def test_the_cell_is_told_with_units(parts):
    text = words(cell, parts)
    for told in ("KR 120 R2700 extra HA", "60 kg", "2500, 2500, 6250 N", "1 to 15 m", "25.0 mm"):
        assert told in text
    assert "no real robot" in text


def test_every_limit_of_the_cell_stands_in_its_table(parts):
    text = words(cell, parts)
    assert {*Limits.model_fields} - {"torque", "checks"} == {*_LIMITS}
    for label, _ in _LIMITS.values():
        assert label in text
    assert "10.0°" in text


def test_a_limit_that_the_table_does_not_know_stands_under_its_key(parts, monkeypatch):
    monkeypatch.delitem(_LIMITS, "rail_margin")
    assert "rail_margin, in SI units" in words(cell, parts)


def test_poses_stand_with_their_places_and_the_other_technique(parts):
    text = words(poses, parts)
    assert "ioops (not used)" in text
    x = 1e3 * parts.plan.poses[0].tcp_position[0]
    assert f"{x:.1f}" in text
    scene = poses.body(parts).scene
    assert len(scene.view.scene.places) == len(parts.plan.poses) + 1
    assert str(parts.plan.cell.file).rpartition("/")[0] not in text


def test_readings_are_counted_and_the_worst_is_named(parts):
    text = words(readings, parts)
    unseen = parts.reproduction.unseen
    worst = int(unseen.error.argmax())
    assert f"pose {unseen.pose[worst]} {unseen.load_case[worst]} {1e3 * unseen.max:.3f} mm" in text
    assert "No reading looks wrong" in text or "looks wrong" in text
    deflection = np.linalg.norm(parts.reproduction.calibration.readings.deflection, axis=1)
    assert f"{1e3 * deflection.max():.3f} mm" in text


def test_a_suspicious_reading_that_was_kept_holds_back_by_name(parts):
    found = with_figures(parts, suspicious=[{**SUSPICIOUS, "set_aside": False}])
    assert findings(reading_findings, found)[0] == (
        "reading pose 3 north looks wrong and was kept in the fit (0.400 mm off)"
    )
    assert "--exclude 3:north" in next(reading_findings(found)).advice
    assert "pose 3 north 0.400 mm 9.5 0.20 kept in the fit" in words(readings, found)


def test_a_blunder_that_was_set_aside_is_told_and_holds_nothing_back(parts):
    found = with_figures(parts, suspicious=[{**SUSPICIOUS, "set_aside": True}], warnings=[])
    assert findings(reading_findings, found) == []
    assert "set aside as a blunder" in findings(reading_findings, found, holds_back=False)[0]


def test_a_warning_of_the_calibration_holds_back(parts):
    found = with_figures(parts, suspicious=[], warnings=["the springs leave much"])
    assert findings(reading_findings, found) == ["calibration: the springs leave much"]


def test_a_partial_run_holds_back_and_names_the_poses(parts):
    some = replace(parts, dataset=parts.dataset.select(poses=parts.dataset.poses[2:]))
    (told, *_) = findings(reading_findings, some)
    total = len(parts.plan.poses)
    assert (
        told == f"the run is partial: 2 of {total} planned poses have no usable reading (pose 0, 1)"
    )


def test_a_pose_without_a_usable_reading_counts_as_missing(parts):
    data = parts.dataset.to_xarray().copy(deep=True)
    data["status"].values[0] = 1
    spoiled = replace(parts, dataset=type(parts.dataset).from_xarray(data))
    (told, *_) = findings(reading_findings, spoiled)
    assert told.startswith("the run is partial: 1 of")
    # The pose is committed: to resume would repeat nothing.
    advice = next(reading_findings(spoiled)).advice
    assert advice.startswith("Pose 0 is committed and --resume does not repeat")
    assert "a new run" in advice


def test_what_was_not_committed_can_be_resumed_and_nothing_else(parts):
    some = replace(parts, dataset=parts.dataset.select(poses=parts.dataset.poses[2:]))
    begun = tuple(
        entry
        for entry in parts.journal
        if not (entry.event is Event.COMMIT and entry.log is not None and entry.log.pose == 1)
    )
    advice = next(reading_findings(replace(some, journal=begun))).advice
    assert "`elastocal run --resume` measures pose 1, with the cell file" in advice
    assert "Pose 0 is committed and --resume does not repeat" in advice
    assert "--resume" not in next(reading_findings(replace(some, journal=None))).advice


def test_readings_that_were_left_out_by_hand_hold_back_by_name(parts):
    settings = {**to_data(parts.calibrated.figures.settings), "exclude": ["2", "3:north"]}
    (told, *_) = findings(reading_findings, with_figures(parts, settings=settings, suspicious=[]))
    assert told.startswith("2, 3:north (pose, or pose:load case) was left out by hand")


def test_the_check_at_a_load_level_stands_beside_its_noise(parts):
    assert "kept out of the fit" not in words(readings, parts)
    check = {
        "load_cases": ["normal_75"], "readings": 30, "mean": 61e-6, "p95": 0.1e-3, "max": 0.124e-3,
        "rms": 70e-6, "deflection": 1.1e-3, "noise": 12e-6, "source": "stated: metrology",
    }  # fmt: skip
    text = words(readings, with_figures(parts, check=check))
    assert "Check at a load level that was kept out of the fit" in text
    for part in ("normal_75", "0.061 mm", "0.124 mm", "0.012 mm", "stated: metrology"):
        assert part in text


def test_registration_tool_and_noise_are_those_of_the_summary(parts):
    text = words(instruments, parts)
    registration = to_data(parts.summary.registration)
    assert f"{1e6 * registration['stations'][0]['residual_rms']:.1f} µm" in text
    assert f"{parts.summary.tool.mass_kg.value:.2f}" in text
    assert "No station was seen to move during the run" in text
    assert f"{parts.tool.mass:.2f} kg" in text


@pytest.mark.parametrize("turn", [0.0, 2.0])
def test_the_sensors_turn_is_counted_from_where_the_cell_file_has_it(parts, turn):
    """A sensor that is mounted half round is not turned."""
    mounted, more = (
        Rotation.from_euler("z", angle, degrees=True).as_matrix() for angle in (180.0, turn)
    )
    T = np.eye(4)
    T[:3, :3] = mounted
    sensor = SimpleNamespace(T_flange_sensor=T)
    cell = SimpleNamespace(file=SimpleNamespace(sensor=sensor))
    tool = replace(parts.tool, R_flange_sensor=tuple(map(tuple, (mounted @ more).tolist())))
    told = _tool_file(tool, cell)
    assert (
        "Sensor rotation found, against the cell file's pose of it",
        f"{turn:.2f}°",
    ) in told.rows
    ((_, alone),) = [row for row in _tool_file(tool, None).rows if row[0].startswith("Sensor")]
    assert float(alone.rstrip("°")) > 177.0


def test_a_station_that_moved_holds_back_with_advice(parts):
    move = {
        "station": "station_1", "from_pose": 4, "distance": 2e-3, "angle": 0.0,
        "log10_probability_of_chance": -9.0,
    }  # fmt: skip
    registration = {**to_data(parts.summary.registration), "moves": [move]}
    warning = MOVED(
        station="station_1", before=3, pose=4, jump=2e-3, half=1e-4, angle=0.0, runs=9.0
    )
    found = with_summary(parts, registration=registration, warnings=[warning.stored()])
    assert f"run: {warning}" in findings(instrument_findings, found)
    assert "Fix the tracker's stand" in next(instrument_findings(found)).advice
    assert "moved before pose 4: the marker seemed to jump by 2.000 mm" in words(instruments, found)


def test_no_spring_that_is_not_observable_is_shown_without_saying_so(parts):
    text = words(compliances, parts)
    model = parts.calibrated.model
    for spring, seen in zip(model.model.springs, model.observability.observable, strict=True):
        row = re.search(rf"{re.escape(spring.name)} (.{{0,60}})", text)[1]
        assert ("in group" in row or "too weak to see" in row) is not seen
    for group in model.observability.unobservable:
        assert describe(group) in text


def test_an_error_budget_stands_in_the_report_where_calibrate_was_asked_for_it(parts):
    assert "What the error is made of" not in words(compliances, parts)
    part = {"error": 3e-5, "low": 2e-5, "high": 4e-5, "source": "31 poses, each left out"}
    unknown = {"error": None, "low": None, "high": None, "source": "nothing was repeated"}
    sag = {"term": "sag", "taken": False, "error": None, "worth": None, "low": None, "high": None}
    budget = {
        "deflection": 1e-3, "total": part, "noise": unknown, "fit": part, "rest": part,
        "terms": [{**sag, "reason": "no masses in the URDF"}], "readings": 155, "poses": 31,
    }  # fmt: skip
    text = words(compliances, with_figures(parts, budget=budget))
    assert "all, at left-out poses 0.030 mm 0.020 to 0.040 31 poses, each left out" in text
    assert "noise of a reading not known" in text
    assert "gravity sag no not known" in text
    assert "no masses in the URDF" in text


def test_axial_springs_alone_are_advised_to_be_compared_with_more(parts):
    few = tuple(s for s in parts.calibrated.model.model.springs if s.name.endswith(".axial"))
    model = parts.calibrated.model
    keep = [spring in few for spring in model.model.springs]
    seen = replace(model.observability, observable=(True,) * len(few),
                   unobservable=(), rank=len(few))  # fmt: skip
    smaller = replace(
        model, model=replace(model.model, springs=few), compliance=model.compliance[keep],
        draws=model.draws[:, keep], observability=seen,
    )  # fmt: skip
    found = replace(parts, calibrated=replace(parts.calibrated, model=smaller))
    (told,) = [each for each in compliance_findings(found) if each.advice]
    assert "--springs bearing" in told.advice


def test_springs_that_production_has_moved_since_hold_back(parts):
    update = SpringUpdate(
        readings=180, courses=("monday",), before=1e-4, after=8e-5, farthest=1.0, ratio=1.1
    )
    assert not findings(compliance_findings, parts)
    moved_by = replace(update, calibrated=(1e-6,))
    # What a later update has left as it was does not take an earlier one back.
    for each, count in ((moved_by, 1), (replace(moved_by, farthest=0.0), 1), (update, 0)):
        moved = replace(parts, calibrated=replace(parts.calibrated, update=each))
        told = findings(compliance_findings, moved)
        assert len([text for text in told if "errors are those of the springs before" in text]) == (
            count
        )
        # The readings are those of the last production, whether it moved the springs or not.
        assert "180" not in str(told)


def test_more_springs_that_predict_worse_hold_back(parts):
    def rung(springs, difference, chosen):
        return {
            "springs": springs, "held_out": 1e-5, "parameters": 6, "chosen": chosen,
            "difference": dict(zip(("mean", "low", "high"), difference, strict=True)),
        }  # fmt: skip

    ladder = [rung("actuated", (0.0, 0.0, 0.0), False), rung("bearing", (2e-5, 1e-5, 3e-5), True)]
    found = findings(compliance_findings, with_figures(parts, ladder=ladder))
    assert "other springs predict left-out poses better than bearing" in found[0]


def saturated(parts, n_train, high, last=20):
    """Change what the codec says of the variant that the calibration is like."""
    (codec,) = parts.codecs
    changed = [
        replace(each, n_train=n_train, low=1, high=high, last=last)
        if each.variant == "bearing"
        else each
        for each in codec.verdicts.saturation
    ]
    verdicts = replace(codec.verdicts, saturation=tuple(changed))
    return replace(parts, codecs=(replace(codec, verdicts=verdicts),))


@pytest.mark.parametrize(
    ("n_train", "high", "told", "holds_back"),
    [
        (20, 20, "the error was still falling", True),
        (12, 20, "fits to up to 20 of", True),
        (12, None, "fits to up to 20 of", True),
        (12, 14, "no longer fell from 12 on", False),
    ],
)
def test_a_codec_holds_back_unless_it_has_settled(parts, n_train, high, told, holds_back):
    found = saturated(parts, n_train, high)
    (text,) = findings(codec_findings, found, holds_back)
    assert told in text
    assert findings(codec_findings, found, not holds_back) == []


def test_without_a_codec_the_number_of_poses_is_not_verified(parts):
    assert "not verified (no codec)" in findings(codec_findings, replace(parts, codecs=()))[0]


def test_table_1_has_the_figures_of_the_process_beside_those_of_the_paper(parts):
    text = words(process, parts)
    line = parts.process.table.lines[-1]
    assert f"{1e3 * line.before.mean:.3f} {1e3 * line.before.max:.3f}" in text
    assert f"Reduction {100.0 * line.reduction.mean:.2f} %" in text
    assert "Paper, reduction 89.30 % 70.19 % 54.00 %" in text


def test_reductions_of_the_paper_are_those_of_its_own_deviations():
    for case in PAPER.values():
        for before, after, share in zip(case.before, case.after, case.reduction, strict=True):
            assert share == pytest.approx(1.0 - after / before, abs=3e-3)


def test_a_process_beyond_the_tolerance_holds_back(parts):
    limits = replace(parts.limits, tolerance=1e-6)
    assert "beyond the tolerance" in findings(process_findings, replace(parts, limits=limits))[0]
    assert findings(process_findings, replace(parts, limits=replace(limits, tolerance=None))) == []


def test_provenance_has_versions_hashes_seeds_and_every_setting(parts):
    text = words(provenance, parts)
    for file in parts.files:
        assert file.name in text
        assert file.sha256 in text
    for told in ("numpy", "pin", "Seed of the search", "engagement.disk_radius 0.025", "seed 0"):
        assert told in text
    assert "schema: elastocal.cell/1" in text
    assert parts.journal[0].run.cell in text


def test_a_process_of_another_model_is_not_evidence_for_this_one(parts):
    broken = Link("process", LinkState.BROKEN, "the process was run with another model")
    (finding,) = process_findings(replace(parts, chain=(broken,)))
    assert finding.startswith("not valid for this report: in simulation, which is no evidence")
    (finding,) = process_findings(parts)
    assert finding.startswith("in simulation, which is no evidence")


def test_a_codec_that_was_changed_is_not_confirmed_by_the_dataset_that_it_names(parts):
    name = parts.codecs[0].name or "codec"
    changed = UsedFile(f"{name}/codec.json", "", "", "", Seal.BROKEN)
    links = verify_chain(replace(parts, files=(changed,)), ChainFiles(None, None, str))
    state = {link.name: link.state for link in links}
    assert state["codec"] is LinkState.UNSTATED
    assert state["model"] is LinkState.WHOLE


def test_what_was_not_verified_is_never_empty(parts):
    text = words(not_verified, parts)
    for told in ("Absolute errors of the arm", "Temperature", "safety function", "A real robot"):
        assert told in text
    assert "Earlier calibration: no earlier calibration was given" in text


@pytest.mark.parametrize(
    ("absence", "holds_back"),
    [
        (MissingPart("dataset", "gone"), True),
        (MissingPart("calibrated model", "gone"), True),
        (MissingPart("tool file", "gone"), False),
        (MissingPart("simulated process", "gone"), True),
        (MissingPart("codec", "torn", damaged=True), True),
    ],
)
def test_only_what_is_essential_holds_back_when_it_is_missing(parts, absence, holds_back):
    found = replace(parts, missing=(absence,))
    assert len(findings(missing_findings, found, holds_back)) == 1
    assert findings(missing_findings, found, not holds_back) == []


def test_doubts_hold_back(parts):
    assert findings(missing_findings, replace(parts, missing=(), doubts=("odd",))) == ["odd"]


def test_an_inspector_sees_what_was_counted_on_the_lines(parts):
    assert "lines of the devices" not in words(readings, parts)
    line = {"device": "kuka_rsi <arm>", "received": 7, "lost": 4, "status": ["cut"]}
    text = words(readings, with_summary(parts, lines=[line | {"answer": [2e-4, 1e-3, 5e-3]}]))
    assert "What was counted on the lines of the devices" in text
    assert "kuka_rsi &lt;arm&gt; 7 4 0 0 0 0 0 0 0 cut 0.20 / 1.00 / 5.00" in text
