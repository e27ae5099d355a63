"""The identity of a calibration: what was calibrated with what, where, when and by whom.

Everything is optional; a certificate lists missing entries in one line. Statements at the run or
for the report precede those of the cell file.
"""

import re
from collections.abc import Mapping
from datetime import date
from typing import Annotated, Any

from pydantic import AfterValidator

from elastocal.cell._quantities import Name, PositiveForce, PositiveLength
from elastocal.errors import SchemaError
from elastocal.records import StrictModel, validate


def _temperature(text: str) -> str:
    # A keyboard has no degree sign.
    found = re.fullmatch(r"(.*\d)\s*(?:deg|°)?\s*([CK])", text)
    if not found:
        raise ValueError("must be a temperature with its unit, such as '21.5 °C' or '21.5 C'")
    return f"{found[1]} {'°C' if found[2] == 'C' else 'K'}"


def _day(text: str) -> str:
    try:
        return date.fromisoformat(text).isoformat()
    except ValueError as error:
        raise ValueError("must be a day, such as '2026-11-22'") from error


class Equipment(StrictModel):
    """A thing with a name plate."""

    type: Name | None = None
    serial: Name | None = None


class SensorIdentity(Equipment):
    """The force sensor."""

    certificate: Name | None = None
    """Number, laboratory and day of its calibration."""
    uncertainty: PositiveForce | None = None
    """Expanded uncertainty (k = 2) of a force by that certificate, in N."""


class TrackerIdentity(Equipment):
    """The tracker, or what else measured positions."""

    certificate: Name | None = None
    """Number, laboratory and day of its calibration."""
    uncertainty: PositiveLength | None = None
    """Expanded uncertainty (k = 2) of a displacement by that certificate, in m."""


class CertificateEntry(StrictModel):
    """An entry of the certificate, shown on the first page of a report."""

    number: Name | None = None
    """Number of the certificate."""
    robot: Equipment = Equipment()
    """Type by default the name of the robot's model."""
    controller: Equipment = Equipment()
    tool: Equipment = Equipment()
    sensor: SensorIdentity = SensorIdentity()
    tracker: TrackerIdentity = TrackerIdentity()
    temperature: Annotated[Name, AfterValidator(_temperature)] | None = None
    operator: Name | None = None
    place: Name | None = None
    date: Annotated[str, AfterValidator(_day)] | None = None
    """Day on which the run began, unless stated."""


ASKED = (
    "number", "operator", "place", "temperature", "robot.serial", "controller.type",
    "controller.serial", "tool.type", "tool.serial", "sensor.type", "sensor.serial",
    "sensor.certificate", "tracker.type", "tracker.serial", "tracker.certificate",
)  # fmt: skip
"""Entries that are asked for before a run if neither cell file nor options state them."""


def certificate_of(entry: CertificateEntry, *stated: Mapping[str, str]) -> CertificateEntry:
    """Return an entry with further statements; later ones precede earlier ones.

    Parameters
    ----------
    entry : CertificateEntry
        Entry of the cell file.
    *stated : mapping of str to str
        Values by key, with a dot before a key within a key: ``{"sensor.serial": "FT-7"}``.

    Raises
    ------
    SchemaError
        If there is no such key, or a value is invalid for it.
    """
    for each in stated:
        nested: dict[str, Any] = {}
        for key, value in each.items():
            first, _, second = key.partition(".")
            inner = nested.setdefault(first, {} if second else value)
            if second and isinstance(inner, dict):
                inner[second] = value
        entry = _merged(entry, validate(nested, CertificateEntry, "certificate"))
    return entry


def _merged(entry: CertificateEntry, other: CertificateEntry) -> CertificateEntry:
    changed: dict[str, Any] = {}
    for name in other.model_fields_set:
        value = getattr(other, name)
        if isinstance(value, Equipment):
            given = {key: getattr(value, key) for key in value.model_fields_set}
            value = getattr(entry, name).model_copy(update=given)
        changed[name] = value
    return entry.model_copy(update=changed)


def unstated(entry: CertificateEntry) -> tuple[str, ...]:
    """Return the keys of `ASKED` that an entry does not state."""
    missing = []
    for key in ASKED:
        first, _, second = key.partition(".")
        value = getattr(entry, first)
        if (getattr(value, second) if second else value) is None:
            missing.append(key)
    return tuple(missing)


def read_statements(texts: tuple[str, ...]) -> dict[str, str]:
    """Return statements such as ``sensor.serial=FT-7`` by key.

    Raises
    ------
    SchemaError
        If one is invalid, or names no key of a certificate.
    """
    stated = {}
    for text in texts:
        key, sign, value = text.partition("=")
        if not sign or not value.strip():
            raise SchemaError(f"--state {text}: is no KEY=VALUE, such as sensor.serial=FT-7")
        stated[key.strip()] = value.strip()
    certificate_of(CertificateEntry(), stated)
    return stated
