"""Errors of the instruments, added to the truth of a campaign.

The devices sample, the procedure averages; here the averages are drawn at once, with the standard
deviations that follow from the same figures of the cell file. Assumed perfect: weight of the tool
and zero of the sensor (identified at every pose), registration of the tracker (0.01 mrad rotates 5
mm by 50 nm).
"""

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import Cell, load_case_time
from elastocal.dataset import Readings
from elastocal.errors import present
from elastocal.results import brief_repr
from elastocal.sim.truth import truth_of
from elastocal.sim.workcell._instruments import (
    COVERAGE,
    LinkEncoders,
    averaged_noise,
    sensor_range,
)
from elastocal.sim.workcell._robot import ARM_JOINTS
from elastocal.sim.workcell.campaign import TrueReadings


class ErrorScales(NamedTuple):
    """Factors on the errors of the instruments; 1 is the cell file's."""

    tracker: float = 1.0
    force: float = 1.0


@dataclass(frozen=True, eq=False)
class ErrorDraws:
    """Unit normals behind all errors of one campaign, whatever part of it is measured."""

    marker: FloatArray
    """Shape (place, 1 + load, 3); the first is the unloaded reading."""
    sensor: FloatArray
    """Shape (place, 1 + load, 3); the first is the unloaded reading."""
    stop: FloatArray
    """Shape (place, 1 + load, 3); the first is the unloaded reading."""
    drift: FloatArray
    """Shape (place, 3)."""
    cross_talk: FloatArray
    """Shape (6, 6)."""
    encoder: FloatArray
    """Shape (place, 1 + load, arm joint); the first is the unloaded reading."""

    def __repr__(self) -> str:
        places, readings, _ = self.marker.shape
        return f"ErrorDraws({places} places, {readings - 1} loads)"

    @classmethod
    def of(cls, places: int, loads: int, rng: np.random.Generator) -> "ErrorDraws":
        """Draw for some places under some load cases."""
        marker, sensor, stop = rng.standard_normal((3, places, 1 + loads, 3))
        drift, cross_talk = rng.standard_normal((places, 3)), rng.standard_normal((6, 6))
        encoder = rng.standard_normal((places, 1 + loads, ARM_JOINTS))
        return cls(marker, sensor, stop, drift, cross_talk, encoder)

    def take(self, places: IndexArray, loads: IndexArray) -> "ErrorDraws":
        """Return the draws of some places and load cases."""
        rows = np.ix_(places, np.concatenate([[0], 1 + loads]))
        return ErrorDraws(
            self.marker[rows], self.sensor[rows], self.stop[rows], self.drift[places],
            self.cross_talk, self.encoder[rows],
        )  # fmt: skip


@brief_repr
@dataclass(frozen=True, eq=False)
class CampaignErrors:
    """Standard deviations of averaged readings; make one with `of`."""

    noise: float
    """Noise of a sample of the tracker at no distance, in m."""
    noise_per_metre: float
    average: float
    """Standard deviation of a loaded average of the tracker over that of a sample."""
    unloaded_average: float
    """The same of an unloaded one."""
    force: tuple[float, float]
    """Noise of an unloaded and of a loaded average of the sensor, in N."""
    drift: FloatArray
    """Drift of each force axis per load case, in N, shape (3,)."""
    gain: FloatArray = field(repr=False)
    """Change of the gain per unit of cross-talk, shape (3, 3, 6, 6)."""
    repeatability: float
    """Error of a stop, in m."""
    encoders: LinkEncoders | None
    """Secondary encoders; None: the arm has none."""
    times: tuple[float, float]
    """Times that an unloaded and a loaded reading are averaged over, in s."""

    @classmethod
    def of(cls, cell: Cell) -> "CampaignErrors":
        """Return the errors of a cell's instruments.

        Raises
        ------
        DeviceError
            If the cell has no force sensor.
        """
        entry, procedure = truth_of(cell), cell.file.procedure
        tracker, sensor, ranges = entry.tracker, entry.sensor, sensor_range(cell)
        times = (procedure.unloaded_average, procedure.average)
        averages = [averaged_noise(tracker.turbulence, time, tracker.rate) for time in times]
        force = [sensor.force_noise / math.sqrt(max(time * sensor.rate, 1.0)) for time in times]
        return cls(
            noise=tracker.noise / COVERAGE,
            noise_per_metre=tracker.noise_per_metre / COVERAGE,
            average=averages[1],
            unloaded_average=averages[0],
            force=(force[0], force[1]),
            drift=sensor.drift / 60.0 * load_case_time(cell) * ranges[:3] / ranges[0],
            gain=sensor.cross_talk * _gain(cell, ranges),
            repeatability=entry.controller.repeatability,
            encoders=LinkEncoders.of(cell),
            times=times,
        )

    def readings(
        self,
        settled: TrueReadings,
        draws: ErrorDraws,
        scales: ErrorScales,
        station: FloatArray,
        load_cases: tuple[str, ...],
        *,
        conditioned: bool = False,
    ) -> Readings:
        """Return the truth with the errors of the instruments, places numbered from 0.

        Parameters
        ----------
        settled : TrueReadings
            The truth.
        draws : ErrorDraws
            Random errors of these places and load cases.
        scales : ErrorScales
            Sizes of the errors.
        station : ndarray, shape (place, 3)
            Tracker station that measures each place, in base, in m.
        load_cases : tuple of str
            Names of the loads.
        conditioned : bool
            Whether the first of them precedes the reference.
        """
        places, loads = settled.force.shape[:2]
        distance = np.linalg.norm(settled.marker - station, axis=1)[:, None, None]
        sigma = scales.tracker * (self.noise + self.noise_per_metre * distance)
        marker = sigma * (
            self.average * draws.marker[:, 1:] - self.unloaded_average * draws.marker[:, :1]
        )
        # The encoders do not see where the arm truly stops; the tracker does.
        marker += self.repeatability * (draws.stop[:, 1:] - draws.stop[:, :1])
        rows = (places * loads, -1)
        link, zero = self._links(settled, draws)
        return Readings(
            pose=np.repeat(np.arange(places), loads),
            load_case=np.tile(load_cases, places),
            joint_position=settled.q.reshape(rows),
            force=self._force(settled, draws, scales.force).reshape(rows),
            controller_displacement=settled.controller_displacement.reshape(rows),
            marker_displacement=(settled.marker_displacement + marker).reshape(rows),
            reference_joint_position=np.repeat(settled.reference_q, loads, axis=0),
            reference_force=np.repeat(self._reference(settled, draws, scales.force), loads, axis=0),
            conditioned=conditioned,
            link_joint_position=link,
            reference_link_joint_position=zero,
        )

    def _links(
        self, settled: TrueReadings, draws: ErrorDraws
    ) -> tuple[FloatArray | None, FloatArray | None]:
        """Return the links under load and at the reference, (reading, joint); no encoders: None."""
        if self.encoders is None:
            return None, None
        unloaded, loaded = (self.encoders.scatter(time) for time in self.times)
        loads = settled.q.shape[1]
        link = self.encoders.read(settled.q, settled.gears, loaded * draws.encoder[:, 1:])
        zero = self.encoders.read(
            settled.reference_q, settled.reference_gears, unloaded * draws.encoder[:, 0]
        )
        return link.reshape(-1, link.shape[-1]), np.repeat(zero, loads, axis=0)

    def _force(self, settled: TrueReadings, draws: ErrorDraws, scale: float) -> FloatArray:
        """Return the force in base as the sensor shows it, shape (place, load, 3), in N."""
        gain = self._true_gain(draws, scale)
        noise = self.force[1] * draws.sensor[:, 1:] - self.force[0] * draws.sensor[:, :1]
        since = np.arange(1, settled.force.shape[1] + 1)[:, None]
        noise = noise + since * self.drift * draws.drift[:, None]
        shown = settled.felt @ gain.T + scale * noise
        force: FloatArray = np.einsum("pij,plj->pli", settled.R_base_sensor, shown)
        return force

    def _reference(self, settled: TrueReadings, draws: ErrorDraws, scale: float) -> FloatArray:
        """Return the force at the reference, shape (place, 3), in N: 0 near contact.

        Averaged as long as what it is counted from, whose noise is in all forces of a place alike.
        """
        shown = settled.reference_felt @ self._true_gain(draws, scale).T
        force: FloatArray = np.einsum("pij,pj->pi", settled.R_base_sensor, shown)
        return force

    def _true_gain(self, draws: ErrorDraws, scale: float) -> FloatArray:
        gain: FloatArray = np.eye(3) + scale * np.einsum("ijkl,kl->ij", self.gain, draws.cross_talk)
        return gain


def _gain(cell: Cell, ranges: FloatArray) -> FloatArray:
    """Return d gain / d cross-talk; see `force_gain`. Shape (3, 3, 6, 6)."""
    T_sensor_tcp = present(cell.T_sensor_tcp, "T_sensor_tcp")
    wrench = np.vstack([np.eye(3), np.cross(T_sensor_tcp[:3, 3], np.eye(3)).T])
    ratio = np.divide.outer(ranges, ranges)
    gain: FloatArray = np.einsum("ik,kl,lj->ijkl", np.eye(3, 6), ratio, wrench)
    return gain
