"""What is stated of a calibration: by the cell file, at the run, for the report."""

import pytest

from elastocal.cell import CertificateEntry, certificate_of, read_statements, unstated
from elastocal.cell.certificate import ASKED
from elastocal.errors import SchemaError


def test_later_statements_go_before_earlier_ones_and_leave_the_rest():
    entry = certificate_of(CertificateEntry(), {"sensor.type": "Omega160", "sensor.serial": "1"})
    found = certificate_of(entry, {"sensor.serial": "2", "place": "Lyon"}, {"place": "Augsburg"})
    assert (found.sensor.type, found.sensor.serial, found.place) == ("Omega160", "2", "Augsburg")


def test_quantities_and_days_are_read_with_their_units():
    stated = {"tracker.uncertainty": "20 um", "temperature": "21.5 degC", "date": "2026-11-22"}
    found = certificate_of(CertificateEntry(), stated)
    assert found.tracker.uncertainty == pytest.approx(20e-6)
    assert (found.temperature, found.date) == ("21.5 °C", "2026-11-22")


def test_only_what_is_missing_is_asked_for():
    assert unstated(CertificateEntry()) == ASKED
    found = certificate_of(CertificateEntry(), {"operator": "A. Meyer", "robot.serial": "7"})
    assert unstated(found) == tuple(key for key in ASKED if key not in ("operator", "robot.serial"))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("sensor.serial", "is no KEY=VALUE"),
        ("sensor.serial=", "is no KEY=VALUE"),
        ("sensor.colour=red", "colour"),
        ("wether=fine", "wether"),
        ("temperature=21", "temperature with its unit"),
        ("temperature=21.5 F", "temperature with its unit"),
        ("tracker.uncertainty=20", "tracker.uncertainty"),
        ("date=yesterday", "must be a day"),
    ],
)
def test_a_statement_that_is_none_is_refused_by_its_name(text, told):
    with pytest.raises(SchemaError, match=told):
        read_statements((text,))


def test_statements_are_read_by_key():
    assert read_statements(("place= Hall 3", "sensor.serial=a=b")) == {
        "place": "Hall 3", "sensor.serial": "a=b",
    }  # fmt: skip


@pytest.mark.parametrize("typed", ["21.5 C", "21.5C", "21.5 degC", "21.5 °C", "21.5deg C"])
def test_a_temperature_is_read_as_it_is_typed(typed):
    assert certificate_of(CertificateEntry(), {"temperature": typed}).temperature == "21.5 °C"
