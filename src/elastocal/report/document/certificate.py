"""The first page of the report: a certificate that prints on one sheet of A4."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.blocks import Stamp
from elastocal.cell import Equipment, SensorIdentity, TrackerIdentity
from elastocal.identification import JOINT_REACH, RAIL_REACH, ProductionCoverage
from elastocal.results import brief_repr
from elastocal.units import in_unit
from elastocal.verdict import (
    Evidence,
    Light,
    LinkState,
    UncertaintyStatement,
    Verdict,
    fitted_readings,
    state_uncertainty,
    why_not_stated,
)
from elastocal.wording import Phrase, counted, mm, phrase, sentences

_MOST_REASONS = 2
"""Reasons on the sheet, of two or three lines each on paper: the rest is in the appendix."""
_WIDE, _HIGH = 600.0, 190.0
"""Inner size of the picture before and after, in its own units."""
_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)


@dataclass(frozen=True)
class Mark:
    """A place on a scale, from 0 to 100, and what it says."""

    at: float
    text: str

    @property
    def anchor(self) -> str:
        """Side of the text on which the place lies, so that it stays within the scale."""
        return "start" if self.at < 34.0 else "end" if self.at > 66.0 else "middle"


@brief_repr
@dataclass(frozen=True)
class ToleranceBar:
    """The calibrated error against the tolerance, along a scale from 0 to 100."""

    mean: Mark
    p95: Mark
    low: float
    high: float
    """Ends of the interval of the 95 % error."""
    span: Phrase
    """The interval in words."""
    largest: Mark
    tolerance: Mark | None
    ticks: tuple[Mark, ...]


@brief_repr
@dataclass(frozen=True)
class BeforeAfter:
    """Deflection and error of the prediction for every reading."""

    before: str
    after: str
    """Paths of dots."""
    tolerance: float | None
    """Height of the line."""
    rows: tuple[Mark, ...]
    """Lines of the scale upwards, ``at`` in units of the picture."""
    columns: tuple[Mark, ...]
    """Numbers of poses."""
    worst: Mark
    """The reading with the largest error, ``at`` along the picture."""
    worst_height: float
    text: Phrase
    width: float = _WIDE
    height: float = _HIGH


@brief_repr
@dataclass(frozen=True)
class Certificate:
    """Contents of the first page."""

    number: str
    identity: tuple[tuple[Phrase, tuple[str | Stamp, ...]], ...]
    """Rows: what, and the parts that are known."""
    not_entered: Phrase | None
    """Entries that are missing, in a line."""
    bar: ToleranceBar | None
    picture: BeforeAfter | None
    reasons: tuple[str, ...]
    more_reasons: Phrase | None
    coverage: Phrase
    uncertainty: Phrase
    signature: Phrase
    run_signature: Phrase


def certificate_of_evidence(evidence: Evidence, verdict: Verdict, signer: str = "") -> Certificate:
    """Return the first page.

    Parameters
    ----------
    evidence, verdict : Evidence, Verdict
        Whatever is there, and what it comes to.
    signer : str
        Public key of the signer of the report; empty without one.
    """
    reasons = tuple(verdict.reasons[:_MOST_REASONS])
    known, missing = _identity(evidence)
    return Certificate(
        evidence.certificate.number or "",
        known,
        phrase("Not entered: {names}.", names=sentences(missing, ", ")) if missing else None,
        _bar(evidence),
        _before_after(evidence),
        reasons,
        _more(len(verdict.reasons) - len(reasons)),
        _coverage(evidence.coverage, verdict.light is Light.RED),
        _uncertainty(evidence, state_uncertainty(evidence)),
        phrase(
            "This report carries an ed25519 signature, key {key}…; elastocal verify checks it.",
            key=signer[:16],
        )
        if signer
        else phrase("This report carries no electronic signature."),
        _run_signature(evidence),
    )


def _more(reasons: int) -> Phrase | None:
    """Return the place of the reasons that are not on the sheet."""
    if reasons <= 0:
        return None
    many = counted(reasons, "more reason")
    return phrase("{reasons} in section 1 of the appendix.", reasons=many)


_Row = tuple[Phrase, tuple[str | Stamp, ...]]


def _identity(evidence: Evidence) -> tuple[tuple[_Row, ...], list[Phrase]]:
    """Return the details of the calibration in rows, and the missing ones."""
    entry, cell = evidence.certificate, evidence.cell
    sensor = None if cell is None else cell.file.sensor
    named = None if sensor is None else sensor.name
    mass = _tool_mass(evidence)
    contact = None if evidence.figures is None else evidence.figures.contact
    things = (
        (phrase("Robot"), entry.robot, evidence.robot, ()),
        (phrase("Controller"), entry.controller, None, ()),
        (phrase("Tool"), entry.tool, None, mass),
        (phrase("Force sensor"), entry.sensor, named, ()),
        (phrase("Tracker"), entry.tracker, None, ()),
    )
    rows, missing = list[_Row](), list[Phrase]()
    # Without a tracker there is none to name.
    shown = things if contact is None or contact.tracked else things[:-1]
    for name, thing, own, more in shown:
        parts, lacking = _equipment(thing, own)
        rows += [(name, (*parts, *more))] if parts or more else []
        names = sentences(lacking, ", ")
        missing += [phrase("{thing} ({names})", thing=name, names=names)] if lacking else []
    record = evidence.run_record
    measured = evidence.measured if record is None else record.started
    began = None if measured is None else Stamp(measured)
    day = (
        phrase("Date of the simulated run")
        if evidence.simulated
        else phrase("Date of the measurement")
    )
    others: tuple[tuple[Phrase, str | Stamp | None], ...] = (
        (phrase("Tested with"), _tested_with(evidence)),
        *(((phrase("Zero"), contact.sentence()),) if contact is not None else ()),
        (day, began or entry.date),
        (phrase("Place"), entry.place),
        (phrase("Temperature"), entry.temperature),
        (phrase("Operator"), entry.operator),
    )
    for name, value in others:
        if value is None:
            missing.append(name)
        else:
            rows.append((name, (value,)))
    return tuple(rows), missing


def _equipment(thing: Equipment, own: str | None) -> tuple[tuple[str, ...], list[Phrase]]:
    """Return the details of a device, and the missing ones; ``own`` replaces a missing type."""
    kind = thing.type or own
    parts, lacking = [kind] if kind else [], [] if kind else [phrase("type")]
    if thing.serial:
        parts.append(phrase("serial {number}", number=thing.serial))
    else:
        lacking.append(phrase("serial number"))
    if isinstance(thing, SensorIdentity | TrackerIdentity):
        if thing.certificate:
            parts.append(phrase("certificate {number}", number=thing.certificate))
        else:
            lacking.append(phrase("calibration certificate"))
    return tuple(parts), lacking


def _tool_mass(evidence: Evidence) -> tuple[Phrase, ...]:
    """Return the mass of the tool as it was measured, else as the cell file states it."""
    measured = None if evidence.summary is None else evidence.summary.tool.mass_kg.value
    if evidence.tool is not None and "mass" not in evidence.tool.undetermined:
        measured = evidence.tool.mass
    if measured is not None:
        return (phrase("{mass} kg, measured", mass=f"{measured:.1f}"),)
    if evidence.cell is None:
        return ()
    return (phrase("{mass} kg by the cell file", mass=f"{evidence.cell.file.tool.mass:g}"),)


def _tested_with(evidence: Evidence) -> Phrase | None:
    """Return the poses and the measured forces of the test."""
    tested = fitted_readings(evidence)
    return None if tested is None else tested.sentence()


def _coverage(found: ProductionCoverage | None, red: bool) -> Phrase:
    if found is None:
        return phrase("Not known: the cell file names no production path (process.file).")
    reach = phrase(
        "{angle}° in each joint but the last", angle=f"{in_unit(JOINT_REACH, 'deg'):.0f}"
    )
    if found.rail is not None:
        reach = phrase("{reach} and {rail} of rail", reach=reach, rail=mm(RAIL_REACH, 0))
    points = counted(found.rows, "point")
    near = (
        phrase(
            "All {points} of the production path lie within {reach} of a tested posture, under"
            " forces within those tested there.",
            points=points,
            reach=reach,
        )
        if found.covered >= 1.0
        else phrase(
            "{share} of {points} of the production path lie within {reach} of a tested posture,"
            " under forces within those tested there.",
            # Not rounded up: less than all must not look like all.
            share=f"{np.floor(1e3 * found.covered) / 10.0:g}%",
            points=points,
            reach=reach,
        )
    )
    caution = (
        phrase("This does not show that the predictions are right there.")
        if red
        else phrase("The accuracy at these points was not measured.")
    )
    return sentences([near, caution])


def _bar(evidence: Evidence) -> ToleranceBar | None:
    unseen, tolerance = evidence.unseen, evidence.limits.tolerance
    if unseen is None:
        return None
    longest = 1.08 * max(unseen.max, unseen.p95.high, tolerance or 0.0)
    end, step = _scale(in_unit(longest, "mm"), 5)

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
        phrase("{low} to {high}", low=mm(unseen.p95.low), high=mm(unseen.p95.high)),
        mark(unseen.max),
        None if tolerance is None else mark(tolerance),
        tuple(Mark(100.0 * tick / end, f"{tick:.{_digits(step)}f}") for tick in ticks),
    )


def _before_after(evidence: Evidence) -> BeforeAfter | None:
    unseen, tested = evidence.unseen, fitted_readings(evidence)
    if unseen is None or tested is None:
        return None
    size = np.linalg.norm(tested.deflection, axis=1)
    poses = sorted(set(map(int, tested.pose)))
    place = {pose: number for number, pose in enumerate(poses)}
    end, step = _scale(in_unit(max(float(size.max()), unseen.max), "mm"), 4)
    between = _WIDE / max(len(poses), 1)

    def dots(pose: IndexArray, values: FloatArray, aside: float) -> str:
        x = (np.array([place[int(each)] for each in pose]) + 0.5 + aside) * between
        y = _HIGH * (1.0 - in_unit(values, "mm") / end)
        return "".join(f"M{a:.1f} {b:.1f}h0" for a, b in zip(x, y, strict=True))

    tolerance = evidence.limits.tolerance
    level = None if tolerance is None else _HIGH * (1.0 - in_unit(tolerance, "mm") / end)
    every = max(1, -(-len(poses) // 16))
    ticks = np.arange(0.0, end + 0.5 * step, step)
    k = int(unseen.error.argmax())
    worst = 100.0 * (place[int(unseen.pose[k])] + 0.62) / len(poses)
    named = phrase("pose {pose}: {error}", pose=unseen.pose[k], error=mm(unseen.max))
    return BeforeAfter(
        dots(tested.pose, size, -0.12),
        dots(unseen.pose, unseen.error, 0.12),
        level if level is not None and level >= 0.0 else None,
        tuple(Mark(_HIGH * (1.0 - t / end), f"{t:.{_digits(step)}f}") for t in ticks),
        tuple(Mark((place[pose] + 0.5) * between, str(pose)) for pose in poses[::every]),
        Mark(worst, named),
        _HIGH * (1.0 - in_unit(unseen.max, "mm") / end),
        phrase(
            "On average the arm gave way by {before}, and the prediction was wrong by {after}."
            " The arm pressed and was measured; no correction was switched on.",
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
    """Return the decimals that distinguish lines.

    >>> _digits(0.1), _digits(0.25), _digits(2.0)
    (1, 2, 0)
    """
    return next(n for n in range(9) if abs(round(step, n) - step) < 1e-9 * step)


def _uncertainty(evidence: Evidence, statement: UncertaintyStatement | None) -> Phrase:
    if statement is None:
        return why_not_stated(evidence)
    named = {"expanded": mm(statement.expanded), "factor": f"{statement.factor:.2f}"}
    compare = phrase("Compare the tolerance with the errors above, which are lengths in space.")
    if statement.is_complete:
        known = phrase(
            "Along any one axis a predicted deflection is known to ±{expanded} (U, k = {factor},"
            " about 95 % if the errors are normally distributed).",
            **named,
        )
        return sentences([known, compare])
    names = [each.name for each in statement.sources if each.standard is None]
    known = phrase(
        "Along any one axis a predicted deflection is known to ±{expanded} at best (U, k ="
        " {factor}, about 95 % if the errors are normally distributed). Not known, and so not in"
        " it: {names}.",
        names=sentences(names, ", "),
        **named,
    )
    return sentences([known, compare])


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
    return phrase("The record of the run is not signed: it could be altered unnoticed.")
