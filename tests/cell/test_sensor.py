import numpy as np
import pytest

from elastocal.cell import SensorLoad
from elastocal.errors import CompensationError


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"mass": -1.0}, "mass of the tool is -1 kg"),
        ({"mass": np.nan}, "mass of the tool is nan kg"),
        ({"centre": [0.0, np.inf, 0.0]}, "centre of the tool must be finite"),
        ({"moment_bias": [0.0]}, "moment_bias of the tool must be finite numbers of shape"),
        (
            {"matrix": np.diag([1.0, 1.0, 1.0, 1.0, 1.0, np.nan])},
            "matrix of the tool must be finite",
        ),
        ({"matrix": -np.eye(6)}, "matrix of the tool is no calibration near the identity"),
        ({"response": np.eye(3)}, "response of the tool must be finite numbers of shape"),
        ({"T_tcp_sensor": np.diag([1.0, 1.0, -1.0, 1.0])}, "does not hold a rotation"),
    ],
)
def test_a_load_that_cannot_be_is_refused(change, reason):
    with pytest.raises(CompensationError, match=reason):
        SensorLoad(**change)
