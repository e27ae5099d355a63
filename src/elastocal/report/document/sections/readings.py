"""Readings, one by one: what was measured, and how well it fits (paper Fig. 8g and 12b)."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import COUNTED, LineCounts
from elastocal.dataset import Dataset
from elastocal.identification import Calibration, CalibrationSummary, Reproduction, UnseenErrors
from elastocal.procedure.derive import RunSummary
from elastocal.report.document import blocks
from elastocal.report.plots import displacement_figure, pose_grid
from elastocal.verdict import Evidence
from elastocal.wording import counted, mm

_PoseValues = dict[tuple[int, str], float]
"""Values in m by pose and load case."""


def _body(evidence: Evidence) -> Iterator[blocks.Block]:
    dataset, reproduction = evidence.dataset, evidence.reproduction
    if dataset is None:
        yield blocks.Paragraph("The dataset is not known, so no reading is shown.")
        yield from _suspicious(evidence)
        return
    yield from _counts(dataset, evidence.summary)
    if reproduction is not None:
        yield _residuals(reproduction.calibration)
    yield from _grids(dataset, reproduction)
    yield from _suspicious(evidence)
    if reproduction is not None:
        yield _worst(reproduction.unseen)
    yield from _load_check(evidence.figures)


def _counts(dataset: Dataset, summary: RunSummary | None) -> Iterator[blocks.Block]:
    readings = dataset.readings(dataset.joint_names)
    size = np.linalg.norm(readings.deflection, axis=1)
    yield blocks.Facts(
        (
            ("Poses", len(dataset.poses)),
            ("Load cases", ", ".join(dataset.load_cases)),
            ("Usable readings", len(readings)),
            ("Deflection, mean", mm(float(size.mean()))),
            ("Deflection, largest", mm(float(size.max()))),
        )
    )
    if summary is None:
        return
    counts = tuple(summary.readings.counts.items())
    yield blocks.Table("Readings by status", ("Status", "Readings"), counts)
    yield from _lines(summary.lines)
    lost = tuple(
        f"pose {each.pose} {each.load_case}: {each.status}"
        + (f" ({each.note})" if each.note else "")
        for each in summary.readings.not_ok
    )
    if lost:
        yield blocks.Heading("Readings that are not ok")
        yield blocks.Bullets(lost)


def _lines(lines: tuple[LineCounts, ...]) -> Iterator[blocks.Block]:
    """Yield what was counted on the lines of the devices; nothing of simulated ones."""
    if not lines:
        return
    rows = tuple(
        (
            each.device,
            str(each.received),
            *(str(getattr(each, key)) for key, _ in COUNTED),
            "; ".join(each.status) or "ok",
            "" if each.answer is None else " / ".join(f"{1e3 * t:.2f}" for t in each.answer),
        )
        for each in lines
    )
    names = (name.capitalize() for _, name in COUNTED)
    heads = ("Device", "Received", *names, "Status", "Answer, ms: median / 99 % / longest")
    yield blocks.Table("What was counted on the lines of the devices", heads, rows)


def _residuals(calibration: Calibration) -> blocks.Block:
    readings, used = calibration.readings, calibration.used
    commanded = np.linalg.norm(readings.controller_displacement, axis=1)
    residual = np.linalg.norm(calibration.residual, axis=1)
    text = (
        f"Commanded displacement {mm(float(commanded.mean()))} on average,"
        f" {mm(float(commanded.max()))} at most; residual of the fit"
        f" {mm(float(residual[used].mean()))} on average, {mm(float(residual[used].max()))} at most"
        f" ({counted(int(used.sum()), 'reading')} that were fitted, so not held out)"
    )
    return blocks.picture(
        partial(displacement_figure, readings.pose, commanded, residual, used),
        f"Norms of commanded displacements and of residuals of each reading. {text}",
        f"After the paper's Fig. 8g and 12b. {text}.",
    )


def _grids(dataset: Dataset, reproduction: Reproduction | None) -> Iterator[blocks.Block]:
    panels = [("Measured deflection, norm in mm", _grid(dataset, _deflection(dataset)))]
    if reproduction is not None:
        error = _grid(dataset, _errors(reproduction.unseen))
        panels.append(("Error where the pose was left out of the fit, norm in mm", error))
    yield blocks.picture(
        partial(pose_grid, panels, dataset.poses, dataset.load_cases),
        "Shaded table of poses and load cases: " + "; ".join(title for title, _ in panels),
        "Each pose under each load case. Bright is large; the two scales differ.",
    )
    tables = tuple(_number_table(dataset, title, values) for title, values in panels)
    yield blocks.Details("The same numbers as a table", tables)


def _number_table(dataset: Dataset, title: str, values: FloatArray) -> blocks.Table:
    rows = tuple(
        (str(label), *("none" if np.isnan(v) else f"{v:.3f}" for v in row))
        for label, row in zip(dataset.poses, values, strict=True)
    )
    return blocks.Table(title, ("Pose", *dataset.load_cases), rows)


def _deflection(dataset: Dataset) -> _PoseValues:
    readings = dataset.readings(dataset.joint_names)
    size = np.linalg.norm(readings.deflection, axis=1)
    return {
        (int(pose), str(case)): float(value)
        for pose, case, value in zip(readings.pose, readings.load_case, size, strict=True)
    }


def _errors(unseen: UnseenErrors) -> _PoseValues:
    return {
        (int(pose), case): float(value)
        for pose, case, value in zip(unseen.pose, unseen.load_case, unseen.error, strict=True)
    }


def _grid(dataset: Dataset, values: _PoseValues) -> FloatArray:
    """Return values in mm, shape (pose, load_case), NaN where there is none."""
    return np.array(
        [
            [1e3 * values.get((pose, case), np.nan) for case in dataset.load_cases]
            for pose in dataset.poses
        ]
    )


def _suspicious(evidence: Evidence) -> Iterator[blocks.Block]:
    if evidence.calibrated is None:
        return
    figures: CalibrationSummary | None = evidence.figures
    if figures is None or not figures.suspicious:
        yield blocks.Heading("Suspicious readings")
        yield blocks.Paragraph("No reading looks wrong.")
        return
    rows = tuple(
        (
            f"pose {each.pose} {each.load_case}",
            mm(each.residual),
            f"{each.score:.1f}",
            f"{each.leverage:.2f}",
            "set aside as a blunder" if each.set_aside else "kept in the fit",
        )
        for each in figures.suspicious
    )
    heads = ("Reading", "Off by", "Robust score", "Leverage", "What was done")
    yield blocks.Table("Readings that look wrong", heads, rows)


def _worst(unseen: UnseenErrors) -> blocks.Block:
    """Return where the model errs most."""
    order = np.argsort(-unseen.error, kind="stable")[:5]
    rows = tuple(
        (f"pose {unseen.pose[k]} {unseen.load_case[k]}", mm(float(unseen.error[k]))) for k in order
    )
    return blocks.Table("Largest errors, each at a left-out pose", ("Reading", "Error"), rows)


def _load_check(figures: CalibrationSummary | None) -> Iterator[blocks.Block]:
    """Yield the error at the load level that no fit has seen, where one was pressed."""
    check = None if figures is None else figures.check
    if check is None:
        return
    yield blocks.Table(
        "Check at a load level that was kept out of the fit",
        (
            "Load case",
            "Readings",
            "Deflection",
            "Error, mean",
            "95 %",
            "Largest",
            "Noise",
            "Noise from",
        ),
        (
            (
                ", ".join(check.load_cases),
                str(check.readings),
                mm(check.deflection),
                mm(check.mean),
                mm(check.p95),
                mm(check.max),
                "not known" if check.noise is None else mm(check.noise),
                check.source,
            ),
        ),
    )


READINGS = blocks.Section("readings", "What was measured", 30, _body)
