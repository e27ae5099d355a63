"""Campaigns that stop by themselves, held against the truth of the simulated cell.

``make stopping`` runs this file and writes ``stopping.json`` after every campaign: a run that is
cut goes on where it ended.

Each campaign has another arm, with stiffnesses spread by 20 %, and the poses of the example's plan
in the order of the search. After each pose from the eighth on it is asked whether the wanted
accuracy is reached, as `run --until` asks. The truth is the deflection under the loads of
production, at places spread evenly over its path, without noise and friction of the way there.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

from elastocal.cell import load_cell
from elastocal.dataset import Readings
from elastocal.errors import present
from elastocal.identification import (
    FEWEST,
    RISK,
    FitOptions,
    ProductionRows,
    build,
    choose_model,
    level_of_a_look,
    production_error,
    solve,
    with_knowledge,
)
from elastocal.planning import plan_coverage, read_plan
from elastocal.records import record
from elastocal.sim.workcell import CampaignErrors, CampaignSimulator, ContactPoses
from elastocal.sim.workcell.campaign_errors import ErrorDraws, ErrorScales
from elastocal.workflows import init, plan
from gallery.kept import read_kept, rounded, write_kept

QUOTED = Path(__file__).with_name("stopping.json")
WANTED = {
    ("afp", "kind"): 40e-6,
    ("afp", "typical"): 140e-6,
    ("afp", "harsh"): 300e-6,
    ("machining", "kind"): 45e-6,
    ("machining", "typical"): 100e-6,
    ("machining", "harsh"): 200e-6,
}
"""Accuracies that the plan's poses reach on most arms, in m, by example and truth."""
CAMPAIGNS = 20
_SPREAD = 0.2
_PLACES = 24
_OPTIONS = FitOptions(set_blunders_aside=False)
_NAMES = {"afp": "fibre placement", "machining": "roughing"}
_HEAD = ("cell", "truth", "wanted, µm", "stopped by themselves",
         "poses used: least, median, most", "true error then, µm", "missed")  # fmt: skip


@record()
class Stopped:
    """A campaign that has ended, by itself or with its plan."""

    kind: str
    preset: str
    seed: int
    stopped: bool
    """Whether it ended by itself."""
    poses: int
    high: float
    """Upper end of the expected error at the last look, in m."""
    true: float
    """True error on production, root mean square, in m."""


class Example:
    """An example cell with a truth, and the production on which its calibrations are tried."""

    def __init__(self, folder: Path, kind: str, preset: str) -> None:
        """Read an example from a folder of examples, or make and plan it there."""
        self.kind, self.preset, own = kind, preset, folder / kind
        if not (own / "plan" / "plan.json").is_file():
            init(own, kind=kind, force=True)
            plan(own / "cell.yaml", out=own / "plan", compare="none")
        text = (own / "cell.yaml").read_text(encoding="utf-8")
        cell = own / f"{preset}.yaml"
        cell.write_text(text.replace("preset: typical", f"preset: {preset}"), encoding="utf-8")
        self.cell = load_cell(cell)
        self._truth = CampaignSimulator.of(self.cell)
        self._errors = CampaignErrors.of(self.cell)
        found = read_plan(own / "plan")
        poses = [found.poses[number] for number in present(found.search, "search").order]
        self._q = np.array([each.joints for each in poses])
        self._where = ContactPoses(self._q, np.array([each.normal for each in poses]))
        stations = {each.name: each.position_base for each in self.cell.file.trackers}
        self._station = np.array([stations[each.seen_by] for each in poses])
        path = present(self.cell.process, "process")
        self._production = ProductionRows(path.joint_position, path.force, path.moment)
        self._marker = np.array(present(self.cell.file.marker, "marker").position_tcp)

    def campaign(self, seed: int, wanted: float) -> Stopped:
        """Return the campaign of an arm that asks after each pose for an accuracy, in m."""
        robot, rng = self.cell.robot, np.random.default_rng([77, seed])
        factor = np.exp(_SPREAD * rng.standard_normal(self._truth.springs))
        arm = self._truth.stiffened(factor, float(np.exp(_SPREAD * rng.standard_normal())))
        readings = self._measured(arm, rng, 2 * seed)
        level = level_of_a_look(FEWEST, len(self._q))
        for poses in range(FEWEST, len(self._q) + 1):
            mine = readings.take(readings.pose < poses)
            found = production_error(
                robot, mine, self._production, _OPTIONS, self._marker, level=level
            )
            near_enough = found.high <= wanted
            stopped = (
                near_enough
                and present(plan_coverage(self.cell, self._q[:poses]), "coverage").is_enough
            )
            if stopped:
                break
        lengths = rounded(found.high), rounded(self._true_error(arm, mine, 2 * seed + 1))
        return Stopped(self.kind, self.preset, seed, stopped, poses, *lengths)

    def _measured(self, arm: CampaignSimulator, rng: np.random.Generator, seed: int) -> Readings:
        presses = self.cell.file.presses
        settled = arm.settle(self._where, np.array(list(presses.values())), seed=seed)
        draws = ErrorDraws.of(len(self._q), len(presses), rng)
        readings = self._errors.readings(
            settled, draws, ErrorScales(), self._station, tuple(presses)
        )
        return readings.set_aside(readings.load_case == self.cell.file.load_cases.check_case)

    def _true_error(self, arm: CampaignSimulator, readings: Readings, seed: int) -> float:
        """Return the error of the calibration that `calibrate` would make of some readings."""
        robot, few = self.cell.robot, self._production.few()
        choice = choose_model(
            robot, readings, "auto", _OPTIONS, self._marker, production=self._production
        )
        fit = with_knowledge(_OPTIONS, choice.known, choice.model, readings, self._marker)
        compliance = solve(build(choice.model, readings, fit, self._marker)).compliance
        squares = []
        for row in np.linspace(0, len(few) - 1, _PLACES).astype(int):
            q, T = few.joint_position[row, None], robot.forward(few.joint_position[row])
            where = ContactPoses(q, -T[None, :3, 2])
            there = arm.settle(where, (T[:3, :3].T @ few.force[row])[None], seed=seed)
            found = choice.model.deflection(compliance, there.q[:, 0], there.force[:, 0])
            squares.append(np.sum(np.square(found - there.deflection[:, 0])))
        return float(np.sqrt(np.mean(squares)))


def quoted() -> list[Stopped]:
    """Return the campaigns as they are written down."""
    return read_kept(QUOTED, Stopped)


def measure(folder: Path, campaigns: int, kinds: list[str]) -> None:
    """Measure what is not yet written down; examples of the folder are taken, or made there."""
    done = quoted()
    known = {(each.kind, each.preset, each.seed) for each in done}
    examples: dict[tuple[str, str], Example] = {}
    for seed in range(campaigns):
        for (kind, preset), wanted in WANTED.items():
            if kind not in kinds or (kind, preset, seed) in known:
                continue
            if (kind, preset) not in examples:
                examples[kind, preset] = Example(folder, kind, preset)
            done.append(examples[kind, preset].campaign(seed, wanted))
            write_kept(QUOTED, done)
            sys.stdout.write(f"{done[-1]}\n")
            sys.stdout.flush()


def make(_: Path) -> dict[str, str]:
    """Return what is told of the campaigns; there is no figure."""
    found = quoted()
    ended = [each for each in found if each.stopped]
    missed = sum(map(is_missed, ended))
    told = (
        f"{len(ended)} of {len(found)} campaigns stopped by themselves, and {missed} of these"
        f" missed the accuracy that was wanted; the stated risk is {RISK:.0%}"
    )
    return {"stopping": told, "stopping-table": table(found)}


def table(found: list[Stopped]) -> str:
    """Return a row for each example and truth."""
    lines = [_HEAD, ("---",) * len(_HEAD)]
    for (kind, preset), wanted in WANTED.items():
        own = [each for each in found if (each.kind, each.preset) == (kind, preset)]
        ended = [each for each in own if each.stopped]
        if ended:
            poses = np.quantile([each.poses for each in ended], [0.0, 0.5, 1.0])
            true = 1e6 * np.quantile([each.true for each in ended], [0.0, 0.5, 1.0])
            lines.append((
                _NAMES[kind], preset, f"{1e6 * wanted:.0f}", f"{len(ended)} of {len(own)}",
                ", ".join(f"{each:.0f}" for each in poses),
                ", ".join(f"{each:.0f}" for each in true),
                f"{sum(map(is_missed, ended))} of {len(ended)}",
            ))  # fmt: skip
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def is_missed(campaign: Stopped) -> bool:
    """Return whether the true error is above the accuracy that was wanted."""
    return campaign.true > WANTED[campaign.kind, campaign.preset]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--campaigns", type=int, default=CAMPAIGNS, help="of each truth")
    parser.add_argument("--keep", type=Path, help="folder for examples and plans; default: none")
    parser.add_argument("--kinds", nargs="*", choices=list(_NAMES), default=list(_NAMES))
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        measure(given.keep or Path(scratch), given.campaigns, given.kinds)
