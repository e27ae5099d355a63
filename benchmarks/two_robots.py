"""Two robots by presses on each other: error at unseen meetings, for docs/decisions/0127.

``python benchmarks/two_robots.py [VARIANT …] [--seeds SEED …]``; half a minute a variant. The
truth is simulated: bending links, stiffening gears, arms that differ by 20 %, meetings of unequal
stiffness.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from elastocal.elastic import ElasticModel
from elastocal.identification import (
    CalibratedModel,
    Contact,
    DriveCompliances,
    FitOptions,
    calibrate,
    rung_of,
    with_knowledge,
)
from elastocal.sim import Tips, press_together, true_arm
from elastocal.two_robots import (
    PairCell,
    identify_pair,
    load_pair_cell,
    pair_readings,
    plan_meetings,
    write_pair_example,
)
from elastocal.two_robots.meetings import meeting_pool

SEEDS, UNSEEN = range(5), 60
OBLIQUE = ('["3600 mm", "0 mm", "0 mm"], abc', '["3600 mm", "300 mm", "0 mm"], abc')
CLAMPED = ('light: "50 N"', 'light: "50 N", clamped: true')
OTHER = ("name: right\n    robot: {model: KR 210 R2700-2}",
         "name: right\n    robot: {model: KR 240 R2900-2}")  # fmt: skip
VARIANTS = {
    "facing": (),
    "oblique": (OBLIQUE,),
    "clamped": (OBLIQUE, CLAMPED),
    "known": (OBLIQUE,),
    "two types": (OBLIQUE, OTHER),
    "two types, known": (OBLIQUE, OTHER),
}
"""Changes of the example by the name of the variant; ``known``: a tracker calibrated one arm."""


def cell_of(variant: str, folder: Path) -> PairCell:
    """Return the example with 31 meetings, changed as the variant says."""
    path = write_pair_example(folder / "cell.yaml")
    text = path.read_text(encoding="utf-8")
    for old, new in (*VARIANTS[variant], ("poses: 25, candidates: 300", "poses: 31")):
        assert old in text
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")
    return load_pair_cell(path)


def tracked_model(data, robot) -> CalibratedModel:
    """Return the model of an arm that a tracker watched, by gears and the prior of its drives."""
    readings = data.readings(robot.joint_names)
    model = ElasticModel(robot, rung_of(robot, "gears").springs(robot, readings))
    options = FitOptions()
    drives = DriveCompliances.of(robot, readings, options)
    options = with_knowledge(options, drives.known_springs(model), model, readings)
    return calibrate(model, readings, np.random.default_rng(0), options).calibrated


def campaign(variant: str, cell: PairCell, arms, plan, unseen, seed: int) -> list[float]:
    """Return the errors over the deflection of both arms and of their difference, and coverage."""
    rng, sim, T = np.random.default_rng(seed), cell.file.simulation, cell.T_first_second
    off = 1.0 + 0.3 * rng.standard_normal(2).clip(-2.0, 2.0)
    stated = Contact(sim.normal * off[0], sim.across * off[1], 0.3, sim.spread, sim.stop, 1e-6)
    slip = 0.0 if cell.file.presses.clamped else sim.slip
    tips = Tips(sim.normal, sim.across, sim.spread, sim.stop, slip, sim.force_noise)
    cases, light = cell.file.presses.cases, cell.file.presses.light
    data = press_together(arms, T, plan.q(), cases, light, tips, rng)
    known = {}
    if "known" in variant:
        seen = replace(tips, marker=15e-6)
        other = np.random.default_rng(100 + seed)
        watched = press_together(arms, T, plan.q(), cases, light, seen, other)[0]
        known = {cell.arms[0]: tracked_model(watched, cell.robots[0])}
    own = tuple(d.readings(r.joint_names) for d, r in zip(data, cell.robots, strict=True))
    pair = pair_readings(cell.arms, cell.robots, own, T)
    fit = identify_pair(pair, np.random.default_rng(0), stated, known=known, draws=100)
    found = [m.predict(q, f) for m, (q, f, _) in zip(fit.models, unseen, strict=True)]
    true, R = [each[2] for each in unseen], T[:3, :3]
    errors = [_share(p.deflection, t) for p, t in zip(found, true, strict=True)]
    inside = [
        float(np.mean((t >= p.low) & (t <= p.high))) for p, t in zip(found, true, strict=True)
    ]
    apart = [each[0] - each[1] @ R.T for each in ([p.deflection for p in found], true)]
    return [*errors, _share(*apart), *inside]


def _share(found: np.ndarray, true: np.ndarray) -> float:
    error, size = (np.linalg.norm(each, axis=1).mean() for each in (found - true, true))
    return float(error / size)


def main(variants: list[str], seeds: list[int]) -> None:
    """Print mean and worst figures of each variant over the seeds."""
    for variant in variants:
        with tempfile.TemporaryDirectory() as folder:
            cell = cell_of(variant, Path(folder))
        plan = plan_meetings(cell)
        pool, T = meeting_pool(cell, np.random.default_rng(99)), cell.T_first_second
        sim = cell.file.simulation
        arms = tuple(
            true_arm(r.urdf, r.tip, r.base, s, sim.stiffening, sim.bending, r.gravity)
            for r, s in zip(cell.robots, sim.softness, strict=True)
        )
        force = pool.T[:UNSEEN, :3, :3] @ np.array([200.0, 0.0, -900.0])
        unseen = [
            (q[:UNSEEN], f, arm.equilibrium(q[:UNSEEN], f).deflection)
            for arm, q, f in zip(arms, pool.q, (force, -force @ T[:3, :3]), strict=True)
        ]
        rows = np.array([campaign(variant, cell, arms, plan, unseen, seed) for seed in seeds])
        names = ("first", "second", "relative", "inside first", "inside second")
        for name, mean, worst in zip(names, rows.mean(axis=0), _worst(rows), strict=True):
            print(f"{variant:18} {name:14} mean {mean:7.2%}  worst {worst:7.2%}", flush=True)


def _worst(rows: np.ndarray) -> np.ndarray:
    return np.append(rows[:, :3].max(axis=0), rows[:, 3:].min(axis=0))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("variants", nargs="*", metavar="VARIANT", default=list(VARIANTS))
    parser.add_argument("--seeds", nargs="*", type=int, default=list(SEEDS))
    given = parser.parse_args()
    main(given.variants, given.seeds)
