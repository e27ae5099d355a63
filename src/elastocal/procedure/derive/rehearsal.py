"""Prove before a run that its result can be written: a dataset of made-up readings of its shape.

What names, labels, texts and places of a run do to its dataset does not depend on what the devices
will say. So the dataset of a run in which every press went well is put together as at its end, and
turned into the bytes of its file, before the arm moves.
"""

from collections.abc import Iterator

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import LIGHT_CONTACT, Cell
from elastocal.planning import PlanResult, PoseRecord
from elastocal.procedure.derive._rows import LoadRow, LoadValues
from elastocal.procedure.derive.derivation import dataset_of, measured_arm, run_provenance
from elastocal.procedure.derive.doubled import doubled_case, label_doubled
from elastocal.procedure.derive.readings import Mean, PoseReadings, Reading, ToolState
from elastocal.procedure.derive.tool import sensor_load
from elastocal.procedure.record import PoseLog, ReadingStatus, RunFolder, RunRecord, Window
from elastocal.procedure.registration import NO_REGISTRATION, Registration, StationFit
from elastocal.records import netcdf_image

_COMPLIANCE = 1e-6
"""Compliance of the made-up arm, in m/N."""
_SIGMA = 1e-5
"""Standard deviation of its made-up readings, in their units."""


def rehearse_derivation(cell: Cell, plan: PlanResult, folder: RunFolder, record: RunRecord) -> None:
    """Put together the dataset that a run could end with, in memory.

    Parameters
    ----------
    plan : PlanResult
        Its plan.
    folder : RunFolder
        Where the run is going to be.
    record : RunRecord
        What its journal is going to say first.

    Raises
    ------
    DatasetError
        If a name or a number of cell or plan is not allowed in the dataset.
    ProcedureError
        If the cell has no sensor.
    """
    every = [_readings(pose, list(plan.contact.load_cases)) for pose in plan.poses]
    poses = label_doubled(every, plan)
    rows = [row for pose in plan.poses for row in _rows(pose, plan)]
    marker = cell.file.marker
    dataset = dataset_of(
        poses,
        rows,
        list(dict.fromkeys(row.load_case for row in rows)),
        measured_arm(cell),
        _registration(plan, np.zeros(3) if marker is None else marker.position_tcp),
        sensor_load(cell),
        run_provenance(folder, record, None),
    )
    dataset.require_plausible()
    netcdf_image(dataset.to_labelled())


def _registration(plan: PlanResult, lever: FloatArray) -> Registration:
    """Return stations that stand at the base and saw what the plan has them see."""
    if not plan.tracked:
        return NO_REGISTRATION
    none, stations = np.zeros(3), dict[str, list[int]]()
    for pose in plan.poses:
        stations.setdefault(str(pose.seen_by), []).append(pose.id)
    fits = tuple(
        StationFit(name, tuple(poses), np.eye(4), 0.0, none, np.zeros((len(poses), 3)), 0.0)
        for name, poses in stations.items()
    )
    return Registration(fits, lever, none, lever, (), 0.0, 0.0, (), (), {})


def _readings(pose: PoseRecord, load_cases: list[str]) -> PoseReadings:
    """Return readings of a pose at which nothing moved and nothing was felt."""
    tool = ToolState(np.array(pose.joints), pose.T_base_tcp, _mean(), _mean())
    names = [None, *load_cases]
    windows = tuple(
        Window(load_case=name, start=0.0, end=1.0, station=pose.seen_by, status=ReadingStatus.OK)
        for name in names
    )
    readings = dict(zip(names, (Reading(each, tool, _mean()) for each in windows), strict=True))
    light = readings.pop(LIGHT_CONTACT, None)
    reference = readings.pop(None)
    log = PoseLog(pose=pose.id, attempt=1, streams="", windows=windows)
    return PoseReadings(log, reference, tuple(readings.values()), None, light)


def _rows(pose: PoseRecord, plan: PlanResult) -> Iterator[LoadRow]:
    """Yield every load of a pose, as a soft arm takes it."""
    sigma, nan = np.full(3, _SIGMA), np.full(3, np.nan)
    place = pose.id if pose.doubles is None else pose.doubles
    for name, force_tcp in plan.contact.load_cases.items():
        if name != LIGHT_CONTACT:
            force = pose.T_base_tcp[:3, :3] @ np.array(force_tcp)
            values = LoadValues(
                q=np.array(pose.joints),
                controller_displacement=np.zeros(3),
                marker_displacement=_COMPLIANCE * force if plan.tracked else nan,
                marker_sigma=sigma,
                force=force,
                moment=np.zeros(3),
                force_sigma=sigma,
            )
            case = name if pose.doubles is None else doubled_case(name)
            yield LoadRow(place, case, ReadingStatus.OK, "", values)


def _mean() -> Mean:
    zero: FloatArray = np.zeros(3)
    return Mean(zero, zero, zero, 1, 0.0)
