"""Contract of every driver before it connects."""

import pytest

from elastocal.cell import KINDS, LOOPBACK, SIMULATED, DeviceSettings, Driver
from elastocal.drivers import DRIVERS
from elastocal.errors import ElastocalError
from elastocal.records import validate


class DriverSuite:
    """Tests of a driver, the fixture ``name``: that of its entry point."""

    @pytest.fixture
    def driver(self, name: str) -> Driver:
        """Return the driver."""
        return DRIVERS.named(name)

    def test_it_says_what_it_makes_and_whether_it_can_hurt(self, name: str, driver: Driver) -> None:
        assert driver.kinds
        assert driver.kinds <= set(KINDS)
        assert isinstance(driver.real, bool)
        assert driver.real or "arm" not in driver.kinds or name == SIMULATED

    def test_its_settings_are_strict_and_on_this_machine_by_default(self, driver: Driver) -> None:
        for kind in driver.kinds:
            settings = driver.settings(kind)
            assert issubclass(settings, DeviceSettings)
            with pytest.raises(ElastocalError, match="unknown key 'adress'"):
                validate({"adress": "10.0.0.1"}, settings, "devices")
            address = settings.model_fields.get("address")
            assert address is None or address.default == LOOPBACK
