"""The programmed path of a process as a table: what offline correction starts from."""

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from elastocal.compensation.process.course import Course
from elastocal.files import write_text

PROGRAMME = "path.csv"
"""Name of the file in a process's folder."""
_UNITS = {"angle": "rad", "length": "m"}


def write_programme(path: Path, courses: Sequence[Course], joint_units: Mapping[str, str]) -> None:
    """Write programmed joints and expected forces, a row a cycle, atomically.

    The columns are those that ``elastocal compensate`` and ``elastocal predict`` read; forces are
    on the robot, in base.

    Parameters
    ----------
    path : Path
        A CSV file.
    courses : sequence of Course
        With joints.
    joint_units : mapping of str to str
        The robot's joints, from base to tip, with their dimension: ``angle`` or ``length``.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    names = [f"{name}[{_UNITS[dimension]}]" for name, dimension in joint_units.items()]
    table.writerow(["course", "time[s]", *names, *(f"force_{axis}[N]" for axis in "xyz")])
    for course in courses:
        time = course.step * np.arange(len(course.q))
        for t, q, force in zip(
            time.tolist(), course.q.tolist(), course.force.tolist(), strict=True
        ):
            row = [f"{value:.9f}" for value in q] + [f"{value:.3f}" for value in force]
            table.writerow([course.name, f"{t:.3f}", *row])
    write_text(path, text.getvalue())
