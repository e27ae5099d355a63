"""Readings, one by one: what was measured, and how well it fits (paper Fig. 8g and 12b)."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from elastocal import blocks
from elastocal.arrays import FloatArray
from elastocal.cell import COUNTED, LineCounts
from elastocal.dataset import Dataset
from elastocal.identification import (
    Calibration,
    CalibrationSummary,
    Reproduction,
    UnseenErrors,
    suspicious_table,
)
from elastocal.procedure.derive import RunSummary
from elastocal.report.document.section import Section
from elastocal.report.plots import displacement_figure, pose_grid
from elastocal.units import in_unit
from elastocal.verdict import Evidence
from elastocal.wording import Phrase, counted, mm, phrase, phrases, sentences

_PoseValues = dict[tuple[int, str], float]
"""Values in m by pose and load case."""


def _body(evidence: Evidence) -> Iterator[blocks.Block]:
    dataset, reproduction = evidence.dataset, evidence.reproduction
    if dataset is None:
        yield blocks.Paragraph(phrase("The dataset is not known, so no reading is shown."))
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
    check = dataset.readings(dataset.joint_names, check=True) if dataset.check_cases else ()
    size = np.linalg.norm(readings.deflection, axis=1)
    kept = ((phrase("Usable readings kept back as a check"), len(check)),) if check else ()
    yield blocks.Facts(
        (
            (phrase("Poses"), len(dataset.poses)),
            (phrase("Load cases"), ", ".join(dataset.load_cases)),
            (phrase("Usable readings for the fit"), len(readings)),
            *kept,
            (phrase("Deflection, mean"), mm(float(size.mean()))),
            (phrase("Deflection, largest"), mm(float(size.max()))),
        )
    )
    if summary is None:
        return
    counts = tuple((phrase(status), count) for status, count in summary.readings.counts.items())
    yield blocks.Table(phrase("Readings by status"), phrases("Status", "Readings"), counts)
    yield from _lines(summary.lines)
    lost = tuple(
        phrase(
            "pose {pose} {load_case}: {status}",
            pose=each.pose,
            load_case=each.load_case,
            status=phrase("{status} ({note})", status=phrase(each.status.value), note=each.note)
            if each.note
            else phrase(each.status.value),
        )
        for each in summary.readings.not_ok
    )
    if lost:
        yield blocks.Heading(phrase("Readings that are not ok"))
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
            ""
            if each.answer is None
            else " / ".join(f"{in_unit(t, 'ms'):.2f}" for t in each.answer),
        )
        for each in lines
    )
    names = (name.capitalize() for _, name in COUNTED)
    heads = (
        *phrases("Device", "Received"),
        *names,
        *phrases("Status", "Answer, ms: median / 99 % / longest"),
    )
    yield blocks.Table(phrase("What was counted on the lines of the devices"), heads, rows)


def _residuals(calibration: Calibration) -> blocks.Block:
    readings, used = calibration.readings, calibration.used
    commanded = np.linalg.norm(readings.controller_displacement, axis=1)
    residual = np.linalg.norm(calibration.residual, axis=1)
    text = phrase(
        "Commanded displacement (how far the controller says that the tool moved while it pressed,"
        " into the surface too) {commanded} on average, {most} at most; residual of the fit {mean}"
        " on average, {max} at most ({readings} that were fitted, so not held out).",
        commanded=mm(float(commanded.mean())),
        most=mm(float(commanded.max())),
        mean=mm(float(residual[used].mean())),
        max=mm(float(residual[used].max())),
        readings=counted(int(used.sum()), "reading"),
    )
    return blocks.Picture(
        partial(displacement_figure, readings.pose, commanded, residual, used),
        phrase("Commanded displacement and residual of each reading. {text}", text=text),
        text,
    )


def _grids(dataset: Dataset, reproduction: Reproduction | None) -> Iterator[blocks.Block]:
    panels = [(phrase("Measured deflection, norm in mm"), _grid(dataset, _deflection(dataset)))]
    check = dataset.check_cases
    if reproduction is not None:
        error = _grid(dataset, _errors(reproduction.unseen))
        title = phrase("Error where the pose was left out of the fit, norm in mm")
        panels.append((title, error))
    yield blocks.Picture(
        partial(pose_grid, panels, dataset.poses, dataset.load_cases, check),
        phrase("Shaded table of poses and load cases: measured deflection and error"),
        phrase(
            "Length in mm for each pose under each load case, {readings}. Above what was measured,"
            " below the error where the pose was left out of the fit. Bright is large; the two"
            " scales differ.",
            readings=counted(len(dataset.readings(dataset.joint_names)), "reading"),
        ),
    )
    tables = tuple(_number_table(dataset, title, values) for title, values in panels)
    yield blocks.Details(phrase("The same numbers as a table"), tables)


def _number_table(dataset: Dataset, title: str, values: FloatArray) -> blocks.Table:
    rows = tuple(
        (
            str(label),
            *(
                f"{v:.3f}"
                if not np.isnan(v)
                else phrase("check")
                if case in dataset.check_cases
                else phrase("none")
                for case, v in zip(dataset.load_cases, row, strict=True)
            ),
        )
        for label, row in zip(dataset.poses, values, strict=True)
    )
    return blocks.Table(title, (phrase("Pose"), *dataset.load_cases), rows)


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
            [in_unit(values.get((pose, case), np.nan), "mm") for case in dataset.load_cases]
            for pose in dataset.poses
        ]
    )


def _suspicious(evidence: Evidence) -> Iterator[blocks.Block]:
    if evidence.calibrated is None:
        return
    figures: CalibrationSummary | None = evidence.figures
    if figures is None or not figures.suspicious:
        yield blocks.Heading(phrase("Suspicious readings"))
        alone = None if evidence.unseen is None else evidence.unseen.at_one_pose()
        nothing = phrase("No reading was set aside, and none looks wrong by itself.")
        below = phrase("The largest errors stand below.")
        look = [alone.sentence, phrase("Look at that pose.")] if alone else []
        yield blocks.Paragraph(sentences([nothing, *look, below]))
        return
    yield suspicious_table(figures.suspicious)


def _worst(unseen: UnseenErrors) -> blocks.Block:
    """Return the reading with the largest error of the model."""
    order = np.argsort(-unseen.error, kind="stable")[:5]
    rows = tuple(
        (_reading(int(unseen.pose[k]), unseen.load_case[k]), mm(float(unseen.error[k])))
        for k in order
    )
    caption = phrase("Largest errors, each at a left-out pose")
    return blocks.Table(caption, phrases("Reading", "Error"), rows)


def _reading(pose: int, load_case: str) -> Phrase:
    return phrase("pose {pose} {load_case}", pose=pose, load_case=load_case)


def _load_check(figures: CalibrationSummary | None) -> Iterator[blocks.Block]:
    """Yield the error at the load level that no fit has seen, where one was pressed."""
    check = None if figures is None else figures.check
    if check is None:
        return
    yield blocks.Table(
        phrase("Check at a load level that was kept out of the fit"),
        phrases(
            "Load case",
            "Noise from",
            "Readings",
            "Deflection",
            "Error, mean",
            "95 %",
            "Largest",
            "Noise",
        ),
        (
            (
                ", ".join(check.load_cases),
                check.source,
                str(check.readings),
                mm(check.deflection),
                mm(check.mean),
                mm(check.p95),
                mm(check.max),
                phrase("not known") if check.noise is None else mm(check.noise),
            ),
        ),
        texts=2,
    )


READINGS = Section(
    "readings",
    phrase("Readings"),
    phrase("What was measured, and how well does it fit?"),
    30,
    _body,
)
