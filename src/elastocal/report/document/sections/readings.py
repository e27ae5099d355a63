"""What was measured, reading by reading (paper Fig. 8g and 12b)."""

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.dataset import Dataset
from elastocal.identification import Calibration
from elastocal.identification.reproduction import Reproduction
from elastocal.report.document.markup import facts, folded, heading, listed, paragraph, table
from elastocal.report.document.pictures import picture
from elastocal.report.document.section import Content, Finding, Section
from elastocal.report.plots import (
    displacement_figure,
    pose_grid,
)
from elastocal.verdict.evidence import Evidence
from elastocal.wording import counted, mm, spans

Figures = dict[str, Any]


def body(evidence: Evidence) -> Content:
    """Return the section."""
    findings = (*_of_run(evidence), *_of_readings(evidence))
    if evidence.dataset is None:
        text = paragraph("The dataset is not known, so no reading is shown.")
        return Content(text + _suspicious(evidence), findings=findings)
    html = _counts(evidence.dataset, evidence.summary)
    if evidence.reproduction is not None:
        html += _residuals(evidence.reproduction.calibration)
    html += _grids(evidence.dataset, evidence.reproduction)
    return Content(html + _suspicious(evidence) + _worst(evidence), findings=findings)


def _counts(dataset: Dataset, summary: Figures | None) -> str:
    readings = dataset.readings(dataset.joint_names)
    size = np.linalg.norm(readings.deflection, axis=1)
    html = facts(
        [
            ("Poses", len(dataset.poses)),
            ("Load cases", ", ".join(dataset.load_cases)),
            ("Usable readings", len(readings)),
            ("Deflection, mean", mm(float(size.mean()))),
            ("Deflection, largest", mm(float(size.max()))),
        ]
    )
    if summary is None:
        return html
    counts = summary["readings"]["counts"]
    html += table("Readings by status", ("Status", "Readings"), list(counts.items()))
    lost = [
        f"pose {each['pose']} {each['load_case']}: {each['status']}"
        + (f" ({each['note']})" if each["note"] else "")
        for each in summary["readings"]["not_ok"]
    ]
    return html + (heading("Readings that are not ok") + listed(lost) if lost else "")


def _residuals(again: Calibration) -> str:
    readings = again.readings
    commanded = np.linalg.norm(readings.controller_displacement, axis=1)
    residual = np.linalg.norm(again.residual, axis=1)
    used = again.used
    told = (
        f"Commanded displacement {mm(float(commanded.mean()))} on average,"
        f" {mm(float(commanded.max()))} at most; residual of the fit"
        f" {mm(float(residual[used].mean()))} on average, {mm(float(residual[used].max()))} at most"
        f" ({counted(int(used.sum()), 'reading')} that were fitted, so not held out)"
    )
    return picture(
        partial(displacement_figure, readings.pose, commanded, residual, used),
        f"Norms of commanded displacements and of residuals of each reading. {told}",
        f"After the paper's Fig. 8g and 12b. {told}.",
    )


def _grids(dataset: Dataset, again: Reproduction | None) -> str:
    panels = [("Measured deflection, norm in mm", _grid(dataset, _deflection(dataset)))]
    if again is not None:
        unseen = again.unseen
        error = {
            (int(pose), case): float(value)
            for pose, case, value in zip(unseen.pose, unseen.load_case, unseen.error, strict=True)
        }
        panels.append(
            ("Error where the pose was left out of the fit, norm in mm", _grid(dataset, error))
        )
    return picture(
        partial(pose_grid, panels, dataset.poses, dataset.load_cases),
        "Shaded table of poses and load cases: " + "; ".join(title for title, _ in panels),
        "Each pose under each load case. Bright is large; the two scales differ.",
    ) + folded("The same numbers as a table", _number_table(dataset, panels))


def _number_table(dataset: Dataset, panels: list[tuple[str, FloatArray]]) -> str:
    return "".join(
        table(
            title,
            ("Pose", *dataset.load_cases),
            [
                (label, *("none" if np.isnan(v) else f"{v:.3f}" for v in row))
                for label, row in zip(dataset.poses, values, strict=True)
            ],
        )
        for title, values in panels
    )


def _deflection(dataset: Dataset) -> dict[tuple[int, str], float]:
    readings = dataset.readings(dataset.joint_names)
    size = np.linalg.norm(readings.deflection, axis=1)
    return {
        (int(pose), str(case)): float(value)
        for pose, case, value in zip(readings.pose, readings.load_case, size, strict=True)
    }


def _grid(dataset: Dataset, values: dict[tuple[int, str], float]) -> FloatArray:
    """Return values in mm, shape (pose, load_case), NaN where there is none."""
    return np.array(
        [
            [1e3 * values.get((pose, case), np.nan) for case in dataset.load_cases]
            for pose in dataset.poses
        ]
    )


def _figures(evidence: Evidence) -> Figures:
    return evidence.calibrated.figures if evidence.calibrated is not None else {}


def _suspicious(evidence: Evidence) -> str:
    if evidence.calibrated is None:
        return ""
    found = _figures(evidence).get("suspicious", [])
    if not found:
        return heading("Suspicious readings") + paragraph("No reading looks wrong.")
    rows = [
        (
            f"pose {each['pose']} {each['load_case']}",
            mm(each["residual"]),
            f"{each['score']:.1f}",
            f"{each['leverage']:.2f}",
            "set aside as a blunder" if each["set_aside"] else "kept in the fit",
        )
        for each in found
    ]
    heads = ("Reading", "Off by", "Robust score", "Leverage", "What was done")
    return table("Readings that look wrong", heads, rows)


def _worst(evidence: Evidence) -> str:
    """Return where the model errs most."""
    if evidence.reproduction is None:
        return ""
    unseen = evidence.reproduction.unseen
    order = np.argsort(-unseen.error, kind="stable")[:5]
    rows = [
        (f"pose {unseen.pose[k]} {unseen.load_case[k]}", mm(float(unseen.error[k]))) for k in order
    ]
    heads = ("Reading", "Error")
    return table("Largest errors, each at a left-out pose", heads, rows)


def _of_run(evidence: Evidence) -> Iterator[Finding]:
    if evidence.plan is not None and evidence.dataset is not None:
        usable = evidence.dataset.readings(evidence.dataset.joint_names).pose
        missing = sorted({pose.id for pose in evidence.plan.poses} - set(map(int, usable)))
        if missing:
            yield Finding(
                f"the run is partial: {len(missing)} of"
                f" {counted(len(evidence.plan.poses), 'planned pose')}"
                f" {'has' if len(missing) == 1 else 'have'} no usable reading"
                f" (pose {spans(missing)})",
                advice="Finish the run: `elastocal run --resume` measures the missing poses.",
            )


def _of_readings(evidence: Evidence) -> Iterator[Finding]:
    figures = _figures(evidence)
    for each in figures.get("suspicious", []):
        name = f"pose {each['pose']} {each['load_case']}"
        if each["set_aside"]:
            yield Finding(
                f"reading {name} was set aside as a blunder ({mm(each['residual'])} off)",
                holds_back=False,
                advice=f"Measure {name} again: its reading cannot be a measurement of this arm.",
            )
        else:
            yield Finding(
                f"reading {name} looks wrong and was kept in the fit ({mm(each['residual'])} off)",
                advice=f"Look at {name}, and leave it out with `--exclude"
                f" {each['pose']}:{each['load_case']}` if it is wrong.",
            )
    excluded = (figures.get("settings") or {}).get("exclude", ())
    if excluded:
        yield Finding(
            f"{', '.join(map(str, excluded))} (pose, or pose:load case) was left out by hand: no"
            " figure of this report speaks of it",
            advice="Measure again what was left out, so that nothing has to be.",
        )
    for warning in figures.get("warnings", []):
        yield Finding(f"calibration: {warning}")


SECTION = Section("readings", "What was measured", body)
