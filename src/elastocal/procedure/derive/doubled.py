"""Presses on two disks: further load cases of the place that was pressed on one disk."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from elastocal.arrays import IndexArray
from elastocal.cell import CONDITIONING
from elastocal.planning import PlanResult
from elastocal.procedure.derive.readings import PoseReadings, Reading


def doubled_case(load_case: str) -> str:
    """Return the load case of a dataset that a press on two disks belongs to."""
    return f"{load_case}_doubled"


def label_doubled(poses: Sequence[PoseReadings], plan: PlanResult) -> tuple[PoseReadings, ...]:
    """Return readings of which those on two disks are further loads of the place they repeat.

    They keep the light contact of their own that they count from. Those of a place that was not
    pressed on one disk are left out: nothing would be compared with them.
    """
    doubles = {pose.id: pose.doubles for pose in plan.poses}
    single = {each.log.pose for each in poses if doubles[each.log.pose] is None}
    found = []
    for each in poses:
        place = doubles[each.log.pose]
        if place is None:
            found.append(each)
        elif place in single:
            # The press before the reference is none of the loads.
            loads = tuple(
                _renamed(load) for load in each.loads if load.window.load_case != CONDITIONING
            )
            found.append(replace(each, loads=loads, doubles=place))
    return tuple(found)


def _renamed(reading: Reading) -> Reading:
    name = doubled_case(str(reading.window.load_case))
    return replace(reading, window=reading.window.model_copy(update={"load_case": name}))


def stacked_contacts(
    poses: Sequence[PoseReadings], labels: Sequence[int], load_cases: Sequence[str]
) -> IndexArray | None:
    """Return the number of stacked disks, shape (pose, load_case); None: one everywhere."""
    doubled = [each for each in poses if each.doubles is not None]
    if not doubled:
        return None
    contacts: IndexArray = np.ones((len(labels), len(load_cases)), dtype=np.intp)
    for each in doubled:
        names = [str(load.window.load_case) for load in each.loads]
        if each.pose in labels:
            contacts[labels.index(each.pose), np.isin(load_cases, names)] = 2
    return contacts
