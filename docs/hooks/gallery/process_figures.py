"""Table 1 over truths, seeds and campaigns: measured by one command, quoted by the build.

``make process-figures`` runs this file. It takes up to an hour, so the site and the
README quote ``process_figures.json``, which it writes after every case: a run that is cut goes on
where it ended. ``docs/hooks/process_tables.py`` makes the tables and the README's sentence of it.

A case is an example cell with a preset and a seed. The procedure is run, calibrated with each
layout of springs, the tool is weighed, and the process simulated at the programmed, half and turned
load, as `elastocal simulate-process` does. On `typical` the same is done, at the programmed load,
with shorter campaigns and with that of the paper; on every truth with the growth of the arm that is
touched before production, with a press before every reference, alone and with the offset of each
course, and with all of these; on `typical` also without a tracker, and with secondary encoders
that are fitted, or read in production as well. Of `ur20`, an example without a process, the
deflection at left-out poses is measured, and what its prediction leaves of it.
"""

import argparse
import re
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from pathlib import Path

from process_tables import renew_readme

from elastocal.cell import PROCESS_FILE, SensorLoad, load_cell
from elastocal.compensation import ArmGrowth, process
from elastocal.compensation.conditioning import read_sensor_load
from elastocal.compensation.process import Course, DeviationComparison
from elastocal.errors import CompensationError
from elastocal.identification import CalibrateResult, Contact
from elastocal.procedure import RunFolder, read_summary
from elastocal.progress import silent
from elastocal.records import record
from elastocal.robot import Robot
from elastocal.workflows import (
    ProcessTrial,
    calibrate,
    init,
    plan,
    run,
    run_loads,
    tool,
    touch,
)
from elastocal.workflows.simulate_process import with_encoders
from gallery.kept import read_kept, rounded, write_kept

QUOTED = Path(__file__).with_name("process_figures.json")
KINDS = (*process.PROCESSES, "ur20")
TYPICAL, OTHERS = "typical", ("kind", "harsh")
SEEDS = (1, 2, 3, 4, 5)
_LOADS = (1.0, 0.5, -1.0)
_CONDITIONING = "procedure:\n  reference: light_contact\n  conditioning: true"


@dataclass(frozen=True)
class Campaign:
    """A way to plan a cell, and the springs that its readings are given."""

    name: str
    search: dict[str, str]
    """Keys of ``search`` that differ from the cell file."""
    springs: tuple[str, ...]
    points: int = 0
    """Points that are touched cold and warm, so that the growth of the arm is corrected too."""
    loads: tuple[float, ...] = _LOADS
    """Shares of the force that the process is run under."""
    edits: tuple[tuple[str, str], ...] = ()
    """Patterns in the cell file, and what takes their place."""
    measured: str = ""
    """Campaign of which it has cell and run; empty: its own."""
    offset: bool = False
    """Whether every course begins with a press and a reading of its offset."""
    contact: Contact | None = None
    """What is known of the contact, where no tracker measures."""
    encoders: bool = False
    """Whether secondary encoders are read in production."""

    @property
    def cell(self) -> str:
        """The word for its cell and its run; campaigns that measure alike share them."""
        return self.measured or self.name


TEMPLATE = Campaign("template", {}, ("bearing", "auto"))
SHORTER = (
    Campaign("cover 30", {"technique": "cover", "poses": "30"}, ("bearing",), loads=(1.0,)),
    Campaign("i_optimal 8", {"poses": "8"}, ("auto",), loads=(1.0,)),
    Campaign("i_optimal 6", {"poses": "6"}, ("auto",), loads=(1.0,)),
)

TOUCHED = Campaign("touched", {}, ("auto",), points=12)
_CONDITIONED = ((r"# procedure:.*$", _CONDITIONING),)
CONDITIONED = Campaign("conditioned", {}, ("auto",), edits=_CONDITIONED)
_AFTER_IT = partial(Campaign, search={}, springs=("auto",), edits=_CONDITIONED, offset=True)
OFFSET = _AFTER_IT("course offset", measured=CONDITIONED.name)
ALL = _AFTER_IT("touched and offset", measured=CONDITIONED.name, points=12)
_INSTRUMENT = partial(Campaign, search={}, springs=TEMPLATE.springs, loads=_LOADS[:2])
_SPREAD = 0.1
"""Standard deviation of a place's compliance over the mean, of a disk of urethane."""
UNTRACKED = _INSTRUMENT(
    "no tracker",
    edits=(
        (r"  disk_radius:", '  disk_thickness: "5 mm"\n  disk_radius:'),
        (r"  preset: typical", f"  preset: typical\n  contact: {{spread: {_SPREAD}}}"),
    ),
    contact=Contact(spread=_SPREAD),
)
_ENCODERS = ((r"  preset: typical", "  preset: typical\n  encoders: {noise: 2e-6 rad}"),)
FITTED = _INSTRUMENT("encoders fitted", edits=_ENCODERS)
READ = _INSTRUMENT("encoders read", edits=_ENCODERS, measured=FITTED.name, encoders=True)
INSTRUMENTS = UNTRACKED, FITTED, READ


@record()
class Case:
    """What is measured at once."""

    kind: str
    preset: str
    seed: int


@record()
class Deviation:
    """One measure of the deviation at one load: before and after correction, in m.

    `left out`, of a cell without a process: the deflection at left-out poses, and the error of its
    prediction.
    """

    name: str
    load: float
    mean: tuple[float, float]
    max: tuple[float, float]


@record()
class ProcessFigures:
    """What a campaign with one layout of springs made of a case."""

    case: Case
    campaign: str
    springs: str
    chosen: str
    """The layout that was taken, where the readings were to decide."""
    poses: int
    minutes: float
    """Time of the campaign in the cell."""
    left_out: float
    """Mean error at left-out poses, in m, noise of the readings in it."""
    deviations: tuple[Deviation, ...]
    touch_minutes: float | None = None
    """Time of the touches before production; none where nothing is touched."""
    landing_seconds: float | None = None
    """Longest time of a course's landing; none where courses begin at once."""


def all_turns() -> Iterator[tuple[Case, tuple[Campaign, ...]]]:
    """Yield every case with what is measured of it, in an order that may be cut anywhere.

    `typical`, the truth that the README quotes, comes first, its first seed with all campaigns;
    then a seed of each other truth, their other seeds, the shorter campaigns, and those with more
    than springs.
    """
    order = [(TYPICAL, seed) for seed in SEEDS] + [(preset, 1) for preset in OTHERS]
    every = [(preset, seed) for preset in OTHERS for seed in SEEDS]
    for preset, seed in dict.fromkeys((*order, *every)):
        for kind in KINDS:
            case = Case(kind, preset, seed)
            first = (preset, seed) == (TYPICAL, 1) and kind in process.PROCESSES
            yield case, (TEMPLATE, *SHORTER) if first else (TEMPLATE,)
    for seed in SEEDS[1:]:
        for kind in process.PROCESSES:
            yield Case(kind, TYPICAL, seed), SHORTER
    presets = TYPICAL, *OTHERS
    more = *product(((TOUCHED,), (CONDITIONED, OFFSET), (ALL,)), presets), (INSTRUMENTS, TYPICAL)
    for campaigns, preset in more:
        for seed, kind in product(SEEDS, process.PROCESSES):
            yield Case(kind, preset, seed), campaigns


def quoted() -> list[ProcessFigures]:
    """Return the figures as they are written down."""
    return read_kept(QUOTED, ProcessFigures)


@dataclass(frozen=True)
class _Model:
    """A calibration, and the trial of its correction."""

    campaign: Campaign
    springs: str
    poses: int
    minutes: float
    result: CalibrateResult
    trial: ProcessTrial | None
    """None of a cell without a process."""
    state: ArmGrowth | None = None
    """Growth of the arm by touches."""
    landing_seconds: float | None = None
    deviations: list[Deviation] = field(default_factory=list)

    def figures(self, case: Case) -> ProcessFigures:
        """Return what is written down of it."""
        found = self.result.calibration
        assert found is not None
        taken = [rung.springs for rung in found.ladder if rung.chosen]
        return ProcessFigures(
            case, self.campaign.name, self.springs, taken[0] if taken else self.springs,
            self.poses, self.minutes, rounded(found.held_out.mean), tuple(self.deviations),
            None if self.state is None else round(self.state.seconds / 60.0, 2),
            self.landing_seconds,
        )  # fmt: skip


@dataclass(frozen=True)
class Measurement:
    """Measures cases, with the plans that it has made so far."""

    folder: Path
    """Plans and runs that are in it are taken, not made again."""
    jobs: int = 1
    _results: dict[tuple[Path, str], CalibrateResult] = field(default_factory=dict)

    def of(self, case: Case, campaigns: tuple[Campaign, ...]) -> list[ProcessFigures]:
        """Return the figures of a case, one for each campaign and layout of springs."""
        models = [each for campaign in campaigns for each in self._models(case, campaign)]
        if case.kind in process.PROCESSES:
            models = self._run_process(case, models, campaigns)
        else:
            for each in models:
                each.deviations.append(_left_out(each.result))
        return [model.figures(case) for model in models]

    def _run_process(
        self, case: Case, models: list[_Model], campaigns: tuple[Campaign, ...]
    ) -> list[_Model]:
        courses = process.process_courses(case.kind, models[0].trial.cell, case.seed, None)
        name = process.PROCESSES[case.kind].direction
        for campaign in campaigns:
            some = [each for each in models if each.campaign == campaign]
            found = run_loads([each.trial for each in some], courses, campaign.loads, silent)
            for load, runs in found.items():
                for model, own in zip(some, runs, strict=True):
                    model.deviations.append(_deviation(own.line(name), load))
                    model.deviations.append(_deviation(own.spatial("3-D"), load))
        return [_landed(each, courses) for each in models]

    def _models(self, case: Case, campaign: Campaign) -> Iterator[_Model]:
        """Run a campaign, and yield a model for each of its layouts of springs."""
        cell = self._cell(case, campaign)
        made = self.folder / f"{campaign.cell} {case.kind} {case.preset} {case.seed}"
        folder = RunFolder(made / "run")
        if not folder.summary.is_file():
            run(cell, plan=cell.parent / "plan", out=folder.path, seed=case.seed)
        summary = read_summary(folder.summary)
        poses, minutes = summary.poses.committed, round(summary.times.total / 60.0, 2)
        path = cell.parent / PROCESS_FILE if case.kind in process.PROCESSES else None
        state = self._touched(case, cell, campaign, made) if campaign.points else None
        for springs in campaign.springs:
            result = self._results.get((made, springs))
            given = {"springs": springs, "process": path, "contact": campaign.contact}
            result = result or calibrate(folder.dataset, **given)
            self._results[made, springs] = result
            trial = self._trial(case, cell, result, made) if path else None
            if trial is not None:
                landing = process.Landing.of(trial.cell) if campaign.offset else None
                trial = replace(trial, state=state, landing=landing)
                if campaign.encoders:
                    read = with_encoders(trial.settings, trial.cell)
                    trial = replace(trial, settings=read)
            yield _Model(campaign, springs, poses, minutes, result, trial, state)

    def _touched(self, case: Case, cell: Path, campaign: Campaign, made: Path) -> ArmGrowth:
        """Touch the tooling cold and warm at points that presets share."""
        points = cell.parent / "points"
        if not points.is_dir():
            plan(cell, out=points, poses=campaign.points, compare="none")
        run(cell, plan=points, out=made / "cold", seed=case.seed, touch="cold")
        return touch(cell, cold=made / "cold", out=made / "state.json", seed=case.seed)

    def _trial(self, case: Case, cell: Path, result: CalibrateResult, made: Path) -> ProcessTrial:
        file = made / "tool.json"
        if not file.is_file():
            tool(made / "run", out=file)
        load = _load(file, result.calibrated.model.robot)
        settings = process.PROCESSES[case.kind].compensator
        return ProcessTrial(
            load_cell(cell), result.calibrated, load, settings, case.seed, jobs=self.jobs
        )

    def _cell(self, case: Case, campaign: Campaign) -> Path:
        """Return the cell file of a case beside its plan; presets share a plan."""
        folder = self.folder / f"{case.kind} {campaign.cell}"
        if not (folder / "plan" / "plan.json").is_file():
            init(folder, kind=case.kind, force=True)
            cell = folder / "cell.yaml"
            text = cell.read_text(encoding="utf-8")
            for name, value in campaign.search.items():
                text = re.sub(rf"(?m)^  (# )?{name}: \S+", f"  {name}: {value}", text)
            for pattern, replacement in campaign.edits:
                text, count = re.subn(f"(?m)^{pattern}", replacement, text)
                assert count == 1, pattern
            cell.write_text(text, encoding="utf-8")
            without = "tracker" if campaign.contact else None
            plan(cell, out=folder / "plan", compare="none", without=without)
        text = (folder / "cell.yaml").read_text(encoding="utf-8")
        cell = folder / f"{case.preset}.yaml"
        cell.write_text(text.replace("preset: typical", f"preset: {case.preset}"), encoding="utf-8")
        return cell


def _load(path: Path, robot: Robot) -> SensorLoad | None:
    """Return the tool of a campaign; none where its poses do not tilt the tool enough to weigh it.

    The sensor is then zeroed in the air, with the tool of the cell file.
    """
    try:
        return read_sensor_load(path, robot)
    except CompensationError:
        return None


def _landed(model: _Model, courses: Sequence[Course]) -> _Model:
    """Return a model with the longest time of its courses' landings."""
    landing = None if model.trial is None else model.trial.landing
    if landing is None:
        return model
    longest = max(landing.seconds(course) for course in courses)
    return replace(model, landing_seconds=round(longest, 1))


def _left_out(result: CalibrateResult) -> Deviation:
    """Return what a prediction takes away of the deflection at poses that the fit has not seen."""
    found = result.calibration
    assert found is not None
    mean = rounded(found.deflection.mean), rounded(found.held_out.mean)
    largest = rounded(found.deflection.max), rounded(found.held_out.max)
    return Deviation("left out", 1.0, mean, largest)


def _deviation(line: DeviationComparison, load: float) -> Deviation:
    mean, largest = (
        (rounded(before), rounded(after))
        for before, after in (
            (line.before.mean, line.after.mean),
            (line.before.max, line.after.max),
        )
    )
    return Deviation(line.name, load, mean, largest)


def measure(seeds: int, kinds: list[str], anew: bool, keep: Path | None) -> None:
    """Measure what is not yet written down, or all of it; a folder keeps plans and runs."""
    figures = [each for each in quoted() if not (anew and each.case.kind in kinds)]
    done = {(each.case, each.campaign) for each in figures}
    with tempfile.TemporaryDirectory() as folder:
        measurement = Measurement(keep or Path(folder))
        for case, campaigns in all_turns():
            missing = tuple(each for each in campaigns if (case, each.name) not in done)
            if not missing or case.kind not in kinds or case.seed > seeds:
                continue
            figures += measurement.of(case, missing)
            write_kept(QUOTED, figures)
            renew_readme()
            sys.stdout.write(f"{case}\n")
            sys.stdout.flush()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--anew", action="store_true", help="measure also what is written down")
    parser.add_argument("--seeds", type=int, default=len(SEEDS), help="how many seeds")
    parser.add_argument("--kinds", nargs="*", choices=KINDS, default=list(KINDS))
    parser.add_argument("--keep", type=Path, help="folder for plans and runs; default: none")
    given = parser.parse_args()
    measure(given.seeds, given.kinds, given.anew, given.keep)
