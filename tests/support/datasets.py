"""Small valid datasets, as keywords, as labelled arrays, and as a hypothesis strategy."""

import string
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from elastocal.dataset import Dataset

COMPLIANCE = np.array([[2e-6, 1e-7, 0.0], [1e-7, 1e-6, 2e-7], [0.0, 2e-7, 3e-6]])
"""Compliance at the TCP of the made-up robot, in m/N."""

JOINTS = ("joint_1", "joint_2")
MEASURED = ("joint_position", "force", "controller_displacement", "marker_displacement")


def keywords(
    count: int = 3, load_cases: tuple[str, ...] = ("normal", "north"), **changes: Any
) -> dict[str, Any]:
    """Return arguments of `Dataset.from_arrays`; the same ones at every call."""
    random = np.random.default_rng(7)
    shape = (count, len(load_cases), 3)
    force = random.normal(0.0, 300.0, shape)
    controller = random.normal(0.0, 1e-4, shape)
    joints = random.uniform(-2.0, 2.0, (count, len(load_cases), len(JOINTS)))
    return {
        "joint_position": joints,
        "force": force,
        "controller_displacement": controller,
        "marker_displacement": controller + force @ COMPLIANCE,
        "joint_names": JOINTS,
        "load_cases": load_cases,
        **changes,
    }


def full_keywords(**changes: Any) -> dict[str, Any]:
    """Return arguments with every optional variable and attribute, one reading missing."""
    arguments = keywords()
    status = np.zeros((3, 2), dtype=int)
    status[1, 0] = 4
    for name in MEASURED:
        arguments[name][1, 0] = np.nan
    arguments |= {
        "moment": 0.1 * arguments["force"],
        "status": status,
        "force_sigma": 0.5,
        "marker_sigma": np.full((3, 2), 2e-5),
        "tcp_position": np.arange(9.0).reshape(3, 3),
        "poses": (4, 2, 11),
        "robot_name": "arm",
        "robot_urdf": '<robot name="arm">\n  <link name="tcp"/>\n</robot>\n',
        "tcp_frame": "tcp",
        "provenance": "made up, “for tests”",
    }
    return arguments | changes


def second_keywords(**changes: Any) -> dict[str, Any]:
    """Return arguments with everything that is new in ``elastocal.dataset/2``."""
    arguments = full_keywords()
    joints = arguments["joint_position"]
    return arguments | {
        "sequence": [[0, 1], [-1, 4], [7, 2]],
        "contacts": [[1, 2], [1, 1], [3, 1]],
        "reference_joint_position": joints[:, 1] + 1e-3,
        "reference_force": [[0.0, 0.0, -5.0], [1.0, 0.0, -6.0], [0.0, 0.0, 0.0]],
        "link_joint_position": joints + 1e-4,
        "reference_link_joint_position": joints[:, 1] + 1.1e-3,
        "campaigns": ("monday", "monday", "in the winter"),
        "gravity": (0.0, 9.8, -0.5),
        "conditioned": True,
        "check": ("north",),
        **changes,
    }


def dataset(**changes: Any) -> Dataset:
    """Return a small dataset, some keywords replaced."""
    return Dataset.from_arrays(**keywords(**changes))


def labelled(**changes: Any) -> xr.Dataset:
    """Return a labelled dataset that may be changed, made of `full_keywords`."""
    return Dataset.from_arrays(**full_keywords(**changes)).to_xarray().copy(deep=True)


def write_lines(path: Path, *lines: str) -> Path:
    """Write lines to a text file and return its path."""
    path.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
    return path


_NAMES = st.text(string.ascii_lowercase + string.digits + "_- äé", min_size=1, max_size=6).map(
    lambda name: f"j{name}k"
)
_CASES = st.text(string.printable[:95] + "é漢", min_size=1, max_size=8).map(lambda s: f"c{s}c")
_TEXTS = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=30)


def _drawn_of_the_second_schema(
    draw: st.DrawFn, joints: np.ndarray, status: np.ndarray
) -> dict[str, Any]:
    poses, cases = status.shape
    order = draw(st.permutations(range(-5, cases - 5)))
    drawn = {
        "sequence": np.tile(order, (poses, 1)),
        "reference_joint_position": np.nan_to_num(joints[:, 0]),
        "reference_force": draw(hnp.arrays(float, (poses, 3), elements=st.floats(-9.0, 9.0))),
        "link_joint_position": joints + 1e-6,
        "campaigns": draw(st.lists(_CASES, min_size=poses, max_size=poses)),
        "gravity": draw(st.tuples(*[st.floats(-9.0, 9.0)] * 3)),
        "conditioned": True,
    }
    return {name: value for name, value in drawn.items() if draw(st.booleans())}


@st.composite
def datasets(draw: st.DrawFn) -> Dataset:
    """Draw a plausible dataset with any labels, missing readings, units, optional variables."""
    joints = draw(st.lists(_NAMES, min_size=1, max_size=3, unique=True))
    cases = draw(st.lists(_CASES, min_size=1, max_size=3, unique=True))
    poses = draw(st.lists(st.integers(-(2**40), 2**40), min_size=1, max_size=4, unique=True))
    shape = (len(poses), len(cases))
    status = draw(hnp.arrays(np.int8, shape, elements=st.integers(0, 4)))
    status[0] = 0

    def numbers(bound: float, *tail: int) -> np.ndarray:
        elements = st.floats(-bound, bound, width=64)
        return draw(hnp.arrays(float, (*shape, *tail), elements=elements, fill=st.nothing()))

    # Large enough forces that no draw looks like a unit mistake.
    force = numbers(100.0, 3) + 500.0
    controller = numbers(1e-4, 3)
    arguments: dict[str, Any] = {
        # Those of a pose differ by what the arm moves while it is pressed.
        "joint_position": numbers(6.0, len(joints))[:, :1] + numbers(1e-3, len(joints)),
        "force": force,
        "controller_displacement": controller,
        "marker_displacement": controller + 2e-6 * force,
        "joint_units": draw(
            st.lists(st.sampled_from(["rad", "m"]), min_size=len(joints), max_size=len(joints))
        ),
    }
    for name in MEASURED:
        arguments[name][status == 4] = np.nan
    if draw(st.booleans()):
        arguments["moment"] = numbers(50.0, 3)
    if draw(st.booleans()):
        arguments["marker_sigma"] = draw(st.floats(1e-9, 1e-3))
    if draw(st.booleans()):
        arguments["tcp_position"] = numbers(2.0, 3)[:, 0]
    arguments |= _drawn_of_the_second_schema(draw, arguments["joint_position"], status)
    return Dataset.from_arrays(
        joint_names=joints,
        load_cases=cases,
        poses=poses,
        status=status,
        robot_name=draw(_TEXTS),
        robot_urdf=draw(st.none() | _TEXTS.filter(bool)),
        tcp_frame=draw(st.none() | _TEXTS.filter(bool)),
        provenance=draw(_TEXTS),
        **arguments,
    )
