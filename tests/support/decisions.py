"""Decisions that a calibration takes, collected so that two processors can be compared.

As a program it prints those of the campaigns that it is told of as JSON::

    OPENBLAS_CORETYPE=Zen python -m support.decisions 0 200

OpenBLAS chooses its kernels when it is loaded, so that every core type needs a process of its own.
What is compared are decisions: whether a campaign is refused, which rung is taken, which springs
are shown as known, which readings are set aside, which warnings are made, and how many poses were
enough. Figures are compared beside them, as the largest relative difference.
"""

import json
import os
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from elastocal.codec import cross_validate, judge, make_variants
from elastocal.dataset import Readings, read
from elastocal.errors import ElastocalError
from elastocal.identification import (
    FitOptions,
    calibrate,
    choose_model,
    summary,
    with_knowledge,
)
from elastocal.robot import Robot
from elastocal.sim.arm import SHOP_FLOOR, Blunder
from support.cells import QUIET, TRACKED, Cell, linear_truth, rich_truth, robot

FANUC = Path(__file__).parents[2] / "examples" / "fanuc_r2000ic"


def _has_avx512() -> bool:
    """Return whether this processor has the instructions of the newest kernels."""
    described = Path("/proc/cpuinfo")
    return not described.is_file() or "avx512f" in described.read_text(encoding="utf-8")


CORE_TYPES = (
    *(("SkylakeX",) if _has_avx512() else ()),
    *("Haswell", "Zen", "Sandybridge", "Prescott"),
)
"""Kernels of OpenBLAS that the product must decide alike on, of those that run here."""
_SIZES = (3, 4, 5, 6, 8, 10, 12, 16, 23, 31)
_NOISES = (SHOP_FLOOR, TRACKED, QUIET)
_BOUNDS = ((0.0, np.inf), (0.0, np.inf), (-np.inf, np.inf), (1e-9, 2e-9), (0.0, 1e-6))
"""Lower and upper bound of every spring, in rad/(N·m)."""
_CODECS = 20
"""Every so many campaigns one is cross-validated as well."""


@dataclass(frozen=True)
class Case:
    """Readings of a campaign and how they are calibrated."""

    robot: Robot
    readings: Readings
    options: FitOptions
    springs: str
    codec: bool = False


def campaign(number: int) -> Case:
    """Return a simulated campaign of 200 and more kinds, by its number."""
    if number < 0:
        robot_of_data = Robot.from_urdf((FANUC / "fanuc_r2000ic.urdf").read_text(), "link_6")
        readings = read(FANUC / "measurements.csv").readings(robot_of_data.joint_names)
        return Case(robot_of_data, readings, FitOptions(), "auto", codec=True)
    poses = _SIZES[number % len(_SIZES)]
    blunders: tuple[Blunder, ...] = ()
    if number % 7 == 3 and poses > 4:
        blunders = (Blunder(pose=2, load_case="north", offset=(0.0, 0.02, 0.0)),)
    cell = Cell(
        (linear_truth(), rich_truth())[number // len(_SIZES) % 2],
        seed=number,
        poses=poses,
        noise=_NOISES[number // (2 * len(_SIZES)) % len(_NOISES)],
        blunders=blunders,
    )
    bounds = _BOUNDS[number // 11 % len(_BOUNDS)]
    springs = ("auto", "auto", "bearing", "actuated", "gears")[number // 3 % 5]
    return Case(robot(), cell.readings(), FitOptions(*bounds), springs, number % _CODECS == 9)


def decisions(case: Case) -> dict[str, Any]:
    """Return what is decided on a campaign, and the figures that the decisions rest on."""
    try:
        choice = choose_model(case.robot, case.readings, case.springs, case.options)
        options = with_knowledge(case.options, choice.known, choice.model, case.readings)
        found = calibrate(
            choice.model,
            case.readings,
            np.random.default_rng(0),
            options,
            ladder=choice.ladder,
        )
        figures = summary(found, known=choice.known)
    except ElastocalError as error:
        return {"decided": {"refused": _words(str(error))}, "figures": {}}
    decided = {
        "taken": choice.taken,
        "rank": figures.rank,
        "springs": {
            each.name: [
                each.observable,
                each.group,
                each.at_bound,
                each.too_weak,
                each.low > _SHOWN,
            ]
            for each in figures.springs
        },
        "set aside": np.flatnonzero(~found.used).tolist(),
        "warnings": [_words(str(each)) for each in found.warnings],
    }
    # An interval of a spring that nothing holds is not compared: its ends mean nothing.
    held = {each.name: each for each in figures.springs if each.observable}
    measured = {"held out": figures.held_out.mean if figures.held_out else None}
    measured |= {f"{name} {end}": getattr(held[name], end) for name in held for end in _ENDS}
    if case.codec:
        data = cross_validate(case.robot, case.readings, make_variants({}))
        verdicts = judge(data)
        decided["enough poses"] = [[each.n_train, each.settled] for each in verdicts.saturation]
    return {"decided": decided, "figures": measured}


_ENDS = ("compliance", "low", "high")
_SHOWN = 5e-10
"""Compliances below it, in rad/(N·m), are 0.000 in every table: whether an interval begins there or
at zero nobody can see."""
_DUST = 1e-14
"""A compliance below it, in rad/(N·m), is none: no arm has any as small."""


def _words(text: str) -> str:
    """Return a sentence without its figures, which may differ in their last digit."""
    return "".join(" " if letter.isdigit() or letter in ".-+%" else letter for letter in text)


def under(core_type: str, numbers: Iterable[int]) -> dict[str, Any]:
    """Return the decisions on some campaigns under a core type, in a process of its own."""
    environment = {**os.environ, "OPENBLAS_CORETYPE": core_type, "OMP_NUM_THREADS": "1"}
    program = [sys.executable, "-m", "support.decisions", *map(str, numbers)]
    done = subprocess.run(
        program,
        env=environment,
        cwd=Path(__file__).parents[1],
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(done.stdout)


def differences(one: Mapping[str, Any], other: Mapping[str, Any]) -> Iterator[str]:
    """Yield a line for every decision that differs between two core types."""
    for number, found in one.items():
        for key in found["decided"].keys() | other[number]["decided"].keys():
            a, b = found["decided"].get(key), other[number]["decided"].get(key)
            if isinstance(a, dict) and isinstance(b, dict):
                a = {name: each for name, each in a.items() if b.get(name) != each}
                b = {name: b.get(name) for name in a}
            if a != b:
                yield f"campaign {number}: {key}: {a} and {b}"


def furthest(one: Mapping[str, Any], other: Mapping[str, Any]) -> tuple[float, str]:
    """Return the largest relative difference of a figure between two core types, and its name."""
    worst = (0.0, "")
    for number, found in one.items():
        for name, value in found["figures"].items():
            against = other[number]["figures"].get(name)
            if value is not None and against is not None:
                apart = abs(against - value) / max(abs(value), _DUST)
                worst = max(worst, (apart, f"campaign {number}: {name}"))
    return worst


if __name__ == "__main__":
    print(json.dumps({each: decisions(campaign(int(each))) for each in sys.argv[1:]}))
