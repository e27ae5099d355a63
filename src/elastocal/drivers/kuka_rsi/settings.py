"""Settings of a KUKA arm in the cell file, and the bounds that follow from them and the cell.

Example:

    devices:
      arm:
        driver: kuka_rsi
        mode: contact                  # measure (default), contact, compensation
        address: "192.168.10.5"        # of this machine, in the subnet of the RSI line
        port: 49152
        robot: "192.168.10.2"          # of the controller; nobody else is answered
        commissioning: commissioning.json   # elastocal measure-delay
"""

import math
from dataclasses import dataclass
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from elastocal.cell import (
    LOOPBACK,
    Cell,
    DeviceSettings,
    LocalPort,
    PositiveForce,
    PositiveLength,
    PositiveSpeed,
    PositiveTime,
    TranslationalStiffness,
)
from elastocal.drivers.kuka_rsi.commissioning import CommissioningRecord
from elastocal.errors import DeviceError
from elastocal.records import read_json

LATE_DELAY = 0.12
"""Delay from command to motion in s that is assumed where none was measured: the only public
figure, of RSI 2 (erensezener/kuka-rsi3-communicator, issue 2)."""
FASTEST = 0.25
"""Fastest correction, in m/s: a millimetre in a cycle of 4 ms."""
CYCLES = (0.004, 0.012)
"""Cycles of ``#IPO_FAST`` and ``#IPO``, in s."""
CORRECTIONS = {"contact": "relative", "compensation": "absolute"}
"""Kind of correction of each mode that corrects."""
HOLD_ON = {"relative": 0, "absolute": 1}
"""``HOLDON`` of each kind of correction: what the controller takes for a missing answer."""
_WRONG_PAIRS = {
    ("absolute", 0): "a lost answer would be a jump to zero for one cycle",
    ("relative", 1): "a lost answer would repeat the last piece: the arm would run away",
}
_LAST_RESORT = 1.2
"""Excess over that limit at which the arm stops by itself. The supervisor acts first and can
retract the arm, whereas an arm that has stopped stays on the surface."""
_BELOW = 0.95
"""Largest correction of the PC over POSCORR's limit: the PC's is felt first."""
_MONITOR = 1.2
"""Limit of POSCORRMON over that of POSCORR, as in KUKA's defaults of 6 and 5 mm."""
_ROOM = 5e-3
"""Way beyond approach and travel limit that corrections may take, in m."""
_COMPENSATION = 3e-3
"""Largest correction of a compensation by default, in m."""


def _one_of_the_cycles(cycle: float) -> float:
    if not any(math.isclose(cycle, known) for known in CYCLES):
        raise ValueError("must be 4 ms (#IPO_FAST) or 12 ms (#IPO)")
    return cycle


def require_pair(correction: str, hold_on: int) -> None:
    """Refuse a kind of correction with the wrong ``HOLDON``.

    Raises
    ------
    ValueError
        With what would happen.
    """
    why = _WRONG_PAIRS.get((correction, hold_on))
    if why is not None:
        raise ValueError(
            f"{correction} corrections need HOLDON {HOLD_ON[correction]}, not {hold_on}: {why}"
        )


class RsiSettings(DeviceSettings):
    """Settings of a KUKA arm in the cell file."""

    mode: Literal["measure", "contact", "compensation"] = "measure"
    """Whether the arm is only listened to (``ONLYSEND``), pressed with, or corrected on a path."""
    correction: Literal["relative", "absolute"] | None = None
    """Kind of correction; by default, and of no other kind, that of the mode."""
    hold_on: Literal[0, 1] | None = None
    """``HOLDON`` of RKorr; by default, and no other, that of the kind of correction."""
    address: str = LOOPBACK
    """Own address, to which the port is bound."""
    port: Annotated[int, Field(ge=0, le=65535)] = 49152
    robot: str = LOOPBACK
    """Address of the controller."""
    cycle: Annotated[PositiveTime, AfterValidator(_one_of_the_cycles)] = 0.004
    sentype: Annotated[str, Field(pattern=r"^[A-Za-z0-9_]{1,24}$")] = "elastocal"
    rsi_context: Literal["rsi", "rsix"] = "rsi"
    """Form of the RSI contexts: ``rsi`` of KSS before 8.5 (RSI 3), ``rsix`` of KSS 8.5 and later
    (RSI 4 and 5). ``RSI_CREATE`` is called with the suffix of the first, and without that of the
    second."""
    tool: Annotated[int, Field(ge=1, le=16)] = 1
    """Number of the tool whose TOOL_DATA holds the cell's tcp."""
    base: Annotated[int, Field(ge=1, le=32)] = 1
    """Number of the base whose BASE_DATA holds the frame of the robot's description."""
    signs: tuple[Literal[-1, 1], ...] = (1, 1, 1, 1, 1, 1)
    """Sense of A1 to A6 against the joints of the robot's description; those of the catalogue have
    the pendant's."""
    delay: Annotated[PositiveTime, Field(le=1.0)] | None = None
    """Delay from command to motion, in s, used if there is no commissioning record."""
    commissioning: str | None = None
    """File of `elastocal measure-delay`, relative to the cell file."""
    largest_correction: PositiveLength | None = None
    """Largest correction from the programmed place, in m; by default what the procedure needs."""
    correction_speed: Annotated[PositiveSpeed, Field(le=FASTEST)] = 0.05
    """Fastest correction, in m/s."""
    acceleration: Annotated[float, Field(gt=0.0, le=5.0)] = 0.5
    """Acceleration of straight moves, in m/s²."""
    ptp_percent: Annotated[int, Field(ge=1, le=30)] = 10
    """Fastest ``PTP``, in percent of the axis speeds; the controller's program holds it too."""
    contact_stiffness: TranslationalStiffness = 2e6
    """Stiffness of arm, tool and tooling in series, at most, in N/m."""
    force_speed: Annotated[PositiveSpeed, Field(le=0.02)] = 0.005
    """Fastest movement in force control, in m/s."""
    collision_force: PositiveForce = 100.0
    """Change of the force within 50 ms that is a collision while the arm moves freely, in N."""
    model_tolerance: PositiveLength = 5e-3
    """Largest distance of RIst from where the robot's description has the tool, in m."""
    wait: Annotated[PositiveTime, Field(le=3600.0)] = 60.0
    """Largest wait for the controller's first message, in s."""
    timeout: Annotated[int, Field(ge=1, le=100)] = 10
    """``Timeout`` of the ETHERNET object: cycles without a valid answer until the controller
    stops."""

    @model_validator(mode="after")
    def _pairs(self) -> Self:
        if len(self.signs) != 6:
            raise ValueError(f"signs: {len(self.signs)} numbers, must be one for each of A1 to A6")
        if self.mode == "measure":
            return self
        wanted = CORRECTIONS[self.mode]
        given = self.correction or wanted
        if self.hold_on is not None:
            require_pair(given, self.hold_on)
        if given != wanted:
            raise ValueError(f"mode {self.mode} takes {wanted} corrections, not {given}")
        return self

    def own_ports(self) -> tuple[LocalPort, ...]:
        """Return the port that the controller sends to."""
        return (LocalPort("udp", self.address, self.port),)

    def measured(self, cell: Cell) -> CommissioningRecord | None:
        """Return the commissioning record that the settings name; None where they name none.

        Raises
        ------
        FileAccessError, SchemaError
            If it cannot be read.
        DeviceError
            If it is of another robot or cycle.
        """
        if self.commissioning is None:
            return None
        path = cell.path.parent / self.commissioning
        found = read_json(path, CommissioningRecord)
        for what, theirs, ours in (
            ("robot", found.robot, cell.robot.name),
            ("cycle", found.cycle, self.cycle),
        ):
            if theirs != ours:
                raise DeviceError(
                    f"{path}: {what} {theirs} is not that of the cell, {ours}: measure the delay"
                    " again"
                )
        return found

    def motion_delay(self, cell: Cell) -> float:
        """Return the delay from command to motion, in s: measured, given, or the worst known."""
        record = self.measured(cell)
        if record is not None:
            return record.delay
        return LATE_DELAY if self.delay is None else self.delay


@dataclass(frozen=True)
class Bounds:
    """Limits of an arm, SI; what the sign-off sheet shows."""

    correction: float
    """Largest correction of the PC, in m."""
    poscorr: float
    """Limit of POSCORR along each axis, in m."""
    monitor: float
    """Limit of POSCORRMON, in m."""
    turn: float
    """MaxRotAngle of both, in rad; the PC turns nothing."""
    speed: float
    """Fastest correction, in m/s."""
    force: float
    """Force beyond which the arm stops, in N."""
    travel: float
    """Way beyond the contact after which force control gives up, in m."""


def bounds_of(cell: Cell, settings: RsiSettings) -> Bounds:
    """Return the limits that follow from settings and cell."""
    procedure, engagement = cell.file.procedure, cell.file.engagement
    needed = engagement.approach_distance + procedure.travel_limit + _ROOM
    usual = _COMPENSATION if settings.mode == "compensation" else needed
    largest = settings.largest_correction or usual
    # A whole number of tenths of a millimetre: it is compared by hand.
    poscorr = 1e-4 * math.ceil(1e4 * largest / _BELOW - 1e-6)
    return Bounds(
        correction=largest,
        poscorr=poscorr,
        monitor=1e-4 * math.ceil(1e4 * _MONITOR * poscorr - 1e-6),
        turn=math.radians(1.0),
        speed=settings.correction_speed,
        force=_LAST_RESORT * cell.force_limit,
        travel=procedure.travel_limit,
    )
