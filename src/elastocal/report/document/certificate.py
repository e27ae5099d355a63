"""The first page of the report: a certificate that prints on one sheet of A4."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import CertificateEntry, Equipment
from elastocal.report.document.blocks import Stamp
from elastocal.results import brief_repr
from elastocal.verdict import (
    Evidence,
    LinkState,
    UncertaintyStatement,
    Verdict,
    state_uncertainty,
)
from elastocal.wording import Phrase, counted, mm, phrase, sentences, um

_MOST_REASONS, _LONGEST = 3, 150
"""Reasons on the sheet, and letters of one: the rest stands in the appendix."""
_LONG_REASON, _LONG_NAME = 100, 60
_NOT_STATED = phrase("not stated")
_WIDE, _HIGH = 600.0, 190.0
"""Inner size of the picture before and after, in its own units."""
_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)


@dataclass(frozen=True)
class Mark:
    """A place on a scale, from 0 to 100, and what it says."""

    at: float
    text: str


@brief_repr
@dataclass(frozen=True)
class ToleranceBar:
    """The calibrated error against the tolerance, along a scale from 0 to 100."""

    mean: Mark
    p95: Mark
    low: float
    high: float
    """Ends of the interval of the 95 % error."""
    largest: Mark
    tolerance: Mark | None
    ticks: tuple[Mark, ...]


@brief_repr
@dataclass(frozen=True)
class BeforeAfter:
    """Every reading twice: what the arm gave way, and what the model leaves of it."""

    before: str
    after: str
    """Paths of dots."""
    tolerance: float | None
    """Height of the line."""
    rows: tuple[Mark, ...]
    """Lines of the scale upwards, ``at`` in units of the picture."""
    columns: tuple[Mark, ...]
    """Numbers of poses."""
    text: Phrase
    width: float = _WIDE
    height: float = _HIGH


@brief_repr
@dataclass(frozen=True)
class Certificate:
    """Everything that stands on the first page."""

    number: str
    identity: tuple[tuple[Phrase, tuple[str | Stamp, ...]], ...]
    """Rows: what, and its parts; of unknown ones it says so."""
    bar: ToleranceBar | None
    picture: BeforeAfter | None
    reasons: tuple[str, ...]
    more_reasons: int
    coverage: Phrase
    covered: float | None
    """Share of production, from 0 to 100."""
    uncertainty: Phrase
    signature: Phrase
    run_signature: Phrase

    @property
    def is_full(self) -> bool:
        """Whether so much is to be said that it fits on the sheet in small type only."""
        long = [each for each in self.reasons if len(each) > _LONG_REASON]
        parts = [part for _, parts in self.identity for part in parts if isinstance(part, str)]
        names = [part for part in parts if len(part) > _LONG_NAME]
        return len(long) > 1 or len(names) > 1


def certificate_of_evidence(evidence: Evidence, verdict: Verdict, signer: str = "") -> Certificate:
    """Return the first page.

    Parameters
    ----------
    evidence, verdict : Evidence, Verdict
        Whatever is there, and what it comes to.
    signer : str
        Public key of who signs the report; empty where nobody does.
    """
    entry, found = evidence.certificate, evidence.coverage
    reasons = tuple(map(_short, verdict.reasons[:_MOST_REASONS]))
    return Certificate(
        entry.number or "",
        tuple(_identity(evidence, entry)),
        _bar(evidence),
        _before_after(evidence),
        reasons,
        len(verdict.reasons) - len(reasons),
        phrase("Not known: the cell file names no production path (process.file).")
        if found is None
        else phrase(
            "{share} of {rows} of production lie within the postures and loads that were"
            " calibrated.",
            share=f"{found.covered:.0%}",
            rows=counted(found.rows, "row"),
        ),
        None if found is None else 100.0 * found.covered,
        _uncertainty(state_uncertainty(evidence)),
        phrase(
            "This report carries an ed25519 signature, key {key}…; elastocal verify checks it.",
            key=signer[:16],
        )
        if signer
        else phrase("This report carries no electronic signature."),
        _run_signature(evidence),
    )


def _short(reason: str) -> str:
    return reason if len(reason) <= _LONGEST else f"{reason[: _LONGEST - 1].rstrip()}…"


def _identity(
    evidence: Evidence, entry: CertificateEntry
) -> Iterator[tuple[Phrase, tuple[str | Stamp, ...]]]:
    robot = entry.robot.type or evidence.robot or _NOT_STATED
    yield phrase("Robot"), (robot, _serial(entry.robot))
    yield phrase("Controller"), _equipment(entry.controller)
    yield phrase("Tool"), _equipment(entry.tool)
    sensor = None if evidence.cell is None else evidence.cell.file.sensor
    named = entry.sensor.type or (sensor and sensor.name) or _NOT_STATED
    yield (
        phrase("Force sensor"),
        (named, _serial(entry.sensor), _calibrated(entry.sensor.certificate)),
    )
    yield (
        phrase("Tracker"),
        (
            entry.tracker.type or _NOT_STATED,
            _serial(entry.tracker),
            _calibrated(entry.tracker.certificate),
        ),
    )
    record = evidence.run_record
    began = _NOT_STATED if record is None else Stamp(record.started)
    yield phrase("Date of the measurement"), (entry.date or began,)
    yield phrase("Place"), (entry.place or _NOT_STATED,)
    yield phrase("Temperature"), (entry.temperature or _NOT_STATED,)
    yield phrase("Operator"), (entry.operator or _NOT_STATED,)


def _equipment(equipment: Equipment) -> tuple[str, ...]:
    return equipment.type or _NOT_STATED, _serial(equipment)


def _serial(equipment: Equipment) -> Phrase:
    return phrase("serial {number}", number=equipment.serial or _NOT_STATED)


def _calibrated(certificate: str | None) -> Phrase:
    return phrase("certificate {number}", number=certificate or _NOT_STATED)


def _bar(evidence: Evidence) -> ToleranceBar | None:
    unseen, tolerance = evidence.unseen, evidence.limits.tolerance
    if unseen is None:
        return None
    longest = 1.08 * max(unseen.max, unseen.p95.high, tolerance or 0.0)
    end, step = _scale(1e3 * longest, 5)

    def at(metres: float) -> float:
        return 1e5 * metres / end

    def mark(metres: float) -> Mark:
        return Mark(at(metres), mm(metres))

    ticks = np.arange(0.0, end + 0.5 * step, step)
    return ToleranceBar(
        mark(unseen.mean.value),
        mark(unseen.p95.value),
        at(unseen.p95.low),
        at(unseen.p95.high),
        mark(unseen.max),
        None if tolerance is None else mark(tolerance),
        tuple(Mark(100.0 * tick / end, f"{tick:.{_digits(step)}f}") for tick in ticks),
    )


def _before_after(evidence: Evidence) -> BeforeAfter | None:
    unseen, dataset = evidence.unseen, evidence.dataset
    if unseen is None or dataset is None:
        return None
    readings = dataset.readings(dataset.joint_names)
    size = np.linalg.norm(readings.deflection, axis=1)
    poses = list(dict.fromkeys(sorted(map(int, readings.pose))))
    place = {pose: number for number, pose in enumerate(poses)}
    end, step = _scale(1e3 * max(float(size.max()), unseen.max), 4)
    between = _WIDE / max(len(poses), 1)

    def dots(pose: IndexArray, values: FloatArray, aside: float) -> str:
        x = (np.array([place[int(each)] for each in pose]) + 0.5 + aside) * between
        y = _HIGH * (1.0 - 1e3 * values / end)
        return "".join(f"M{a:.1f} {b:.1f}h0" for a, b in zip(x, y, strict=True))

    tolerance = evidence.limits.tolerance
    level = None if tolerance is None else _HIGH * (1.0 - 1e3 * tolerance / end)
    every = max(1, -(-len(poses) // 16))
    ticks = np.arange(0.0, end + 0.5 * step, step)
    return BeforeAfter(
        dots(readings.pose, size, -0.12),
        dots(unseen.pose, unseen.error, 0.12),
        level if level is not None and level >= 0.0 else None,
        tuple(Mark(_HIGH * (1.0 - t / end), f"{t:.{_digits(step)}f}") for t in ticks),
        tuple(Mark((place[pose] + 0.5) * between, str(pose)) for pose in poses[::every]),
        phrase(
            "Deflection under the test forces, {before} on average, and what the model leaves of"
            " it at poses that it had not seen, {after}.",
            before=mm(float(size.mean())),
            after=mm(unseen.mean.value),
        ),
    )


def _scale(longest: float, lines: int) -> tuple[float, float]:
    """Return the end of a scale and the round step between its lines.

    >>> _scale(0.324, 5), _scale(1.9, 4)
    ((0.4, 0.1), (2.0, 0.5))
    """
    rough = max(longest, 1e-9) / lines
    power = 10.0 ** np.floor(np.log10(rough))
    step = float(min(each * power for each in _STEPS if each * power >= rough * (1.0 - 1e-9)))
    return float(step * np.ceil(longest / step - 1e-9)), step


def _digits(step: float) -> int:
    """Return the decimals that tell lines apart.

    >>> _digits(0.1), _digits(0.25), _digits(2.0)
    (1, 2, 0)
    """
    return next(n for n in range(9) if abs(round(step, n) - step) < 1e-9 * step)


def _uncertainty(statement: UncertaintyStatement | None) -> Phrase:
    if statement is None:
        return phrase("Not stated: no error at poses left out of the fit is known.")
    said = phrase(
        "Predicted deflection along one direction: U = {expanded} (k = 2, about 95 %).",
        expanded=um(statement.expanded),
    )
    if statement.is_complete:
        return said
    names = [each.name for each in statement.sources if each.standard is None]
    lacking = phrase("Not stated, and so not in it: {names}.", names=sentences(names, ", "))
    return phrase("{said} {lacking}", said=said, lacking=lacking)


def _run_signature(evidence: Evidence) -> Phrase:
    if evidence.logs:
        return phrase(
            "The readings were imported from logs, which carry no signature of their own; this"
            " report names them by their SHA-256."
        )
    states = {link.state for link in evidence.chain if link.name == "signature"}
    if LinkState.WHOLE in states:
        return phrase("The record of the run is signed, and the signature holds.")
    if LinkState.BROKEN in states:
        return phrase("The signature of the record of the run does not hold.")
    return phrase("The record of the run is not signed.")
