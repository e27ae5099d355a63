"""The force sensor as it is read: bias, calibration matrix, tool weight and place.

The one place where a raw wrench becomes the wrench on the robot: `elastocal.procedure.derive` and
the online compensator (with its C) take their numbers from here. The sensor reads, in its own
frame,

    y = A [f + m g; t + c x m g] + b,

with force ``f`` and moment ``t`` on the robot about its origin, the tool's mass ``m`` and centre
``c``, gravity ``g`` in the sensor's axes, the bias ``b`` and a matrix ``A`` near the identity that
holds gains, cross-talk and small turns. With ``D``, an estimate of ``A^-1``, and the response ``K``
to gravity, ``D A [m 1; m [c]x]``,

    [f; t] = D (y - b) - K g.

``K`` is known to the noise from static postures even where ``D`` is not: a tool's weight excites
three of the six directions of ``A``.
"""

from dataclasses import dataclass, field

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import CompensationError, present
from elastocal.results import brief_repr
from elastocal.robot import GRAVITY
from elastocal.units import impossible

SENSOR_CORRECTED = "sensor corrected by a tool file"
"""Entry in the provenance of data whose forces were corrected by the rotation and matrix of a tool
file."""
_RIGID = 1e-6
"""Largest distance of a component of R R^T from the identity's."""
_FAR = 0.5
"""Largest distance of an entry of the scaled matrix from the identity's: beyond, it is no
calibration but another sensor. Force rows against moment columns are scaled by `_LEVER`."""
_LEVER = 0.1
"""Moment range of a sensor over its force range, in m; typical of the trade."""


def _zero() -> FloatArray:
    return np.zeros(3)


def weight_response(mass: float, centre: FloatArray) -> FloatArray:
    """Return the wrench of a tool's weight per gravity, ``[m 1; m [c]x]``, shape (6, 3)."""
    x, y, z = mass * np.asarray(centre)
    moment = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.vstack([mass * np.eye(3), moment])


def _finite(name: str, value: object, shape: tuple[int, ...]) -> FloatArray:
    array = np.array(value, dtype=float)
    if array.shape != shape or not np.all(np.isfinite(array)):
        raise CompensationError(
            f"{name} of the tool must be finite numbers of shape {shape}, got {array}"
        )
    array.setflags(write=False)
    return array


@brief_repr
@dataclass(frozen=True, eq=False)
class SensorLoad:
    """Tool weight, bias and matrix of a force sensor, and its place at the tool centre point.

    The default is a sensor at the tool centre point that tool weight and bias have been taken from
    already.

    Raises
    ------
    CompensationError
        If a value is not finite, of another shape, or no rotation, mass or calibration matrix.
    """

    mass: float = 0.0
    """In kg."""
    centre: FloatArray = field(default_factory=_zero)
    """Centre of mass in the sensor's frame, shape (3,), in m."""
    force_bias: FloatArray = field(default_factory=_zero)
    """In the sensor's frame, shape (3,), in N."""
    moment_bias: FloatArray = field(default_factory=_zero)
    """In the sensor's frame, shape (3,), in N·m."""
    T_tcp_sensor: FloatArray = field(default_factory=lambda: np.eye(4))
    """Sensor's measuring frame in the tcp frame, shape (4, 4), in m."""
    gravity: FloatArray = field(default_factory=lambda: np.array(GRAVITY))
    """Acceleration of gravity in base, shape (3,), in m/s²."""
    matrix: FloatArray = field(default_factory=lambda: np.eye(6))
    """``D``: corrects a reading without bias, shape (6, 6); force over moment in 1/m."""
    response: FloatArray | None = None
    """``K``: corrected reading of the weight per gravity, sensor frame, shape (6, 3), in kg and
    kg·m; by default that of mass and centre."""

    def __post_init__(self) -> None:
        for name, shape in (
            ("centre", (3,)),
            ("force_bias", (3,)),
            ("moment_bias", (3,)),
            ("T_tcp_sensor", (4, 4)),
            ("gravity", (3,)),
            ("matrix", (6, 6)),
        ):
            object.__setattr__(self, name, _finite(name, getattr(self, name), shape))
        for name, dimension, values in (
            ("mass", "mass", (self.mass,)),
            ("centre", "length", self.centre),
            ("force_bias", "force", self.force_bias),
            ("moment_bias", "moment", self.moment_bias),
            ("place of the sensor", "length", self.T_tcp_sensor[:3, 3]),
            ("gravity", "acceleration", self.gravity),
        ):
            problem = impossible(dimension, *map(float, values))
            if problem is not None:
                raise CompensationError(f"{name} of the tool is {problem}")
        response = (
            weight_response(self.mass, self.centre) if self.response is None else self.response
        )
        object.__setattr__(self, "response", _finite("response", response, (6, 3)))
        # Unknowns that a reading depends on per gravity: a mass, and a mass times a lever of some
        # metres.
        problem = impossible("mass", *np.abs(response).ravel().tolist())
        if problem is not None:
            raise CompensationError(f"response of the tool is {problem}")
        R = self.T_tcp_sensor[:3, :3]
        if not np.abs(R @ R.T - np.eye(3)).max() <= _RIGID or not np.linalg.det(R) > 0.0:
            raise CompensationError("T_tcp_sensor of the tool does not hold a rotation")
        scale = np.repeat([1.0, _LEVER], 3)
        if not np.abs(self.matrix * scale / scale[:, None] - np.eye(6)).max() <= _FAR:
            raise CompensationError(
                f"matrix of the tool is no calibration near the identity: {self.matrix.tolist()}"
            )

    def R_base_sensor(self, T_base_tcp: FloatArray) -> FloatArray:
        """Return the rotation of the sensor, shape (..., 3, 3)."""
        return T_base_tcp[..., :3, :3] @ self.T_tcp_sensor[:3, :3]

    def weight(self, R_base_sensor: FloatArray) -> FloatArray:
        """Return the corrected reading of the weight, ``K g``, shape (..., 6), sensor frame."""
        return (self.gravity @ R_base_sensor) @ present(self.response, "response").T

    @property
    def has_matrix(self) -> bool:
        """Whether readings are corrected by a matrix."""
        return not np.array_equal(self.matrix, np.eye(6))

    @property
    def matrix_tcp(self) -> FloatArray:
        """Correction from a reading without bias to tcp axes, shape (6, 6)."""
        return self._turn @ self.matrix

    @property
    def response_tcp(self) -> FloatArray:
        """Corrected reading of the weight per gravity, both in tcp axes, shape (6, 3)."""
        return self._turn @ present(self.response, "response") @ self.T_tcp_sensor[:3, :3].T

    @property
    def _turn(self) -> FloatArray:
        """Rotation of force and moment from the sensor's to tcp axes, shape (6, 6)."""
        turn = np.zeros((6, 6))
        turn[:3, :3] = turn[3:, 3:] = self.T_tcp_sensor[:3, :3]
        return turn
