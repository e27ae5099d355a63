"""Table 1 over truths and seeds: measured by one command, quoted by the build.

``python -m gallery.process_figures``, run in ``docs/hooks``, plans each example cell once, and for
each preset, seed and layout of springs runs the procedure, calibrates, weighs the tool and
simulates the process, at the programmed, half and turned load. That takes an hour on two cores, so
the site quotes ``process_figures.json``, which it writes; ``docs/hooks/process_tables.py`` makes
the tables of it.
"""

import json
import tempfile
from dataclasses import dataclass
from pathlib import Path

from elastocal.compensation.process import SeedMeans
from elastocal.records import from_data, record, to_data
from elastocal.workflows import calibrate, init, plan, run, simulate_process, tool

QUOTED = Path(__file__).with_name("process_figures.json")
KINDS = ("afp", "machining")
PRESETS = ("kind", "typical", "harsh")
SPRINGS = ("bearing", "auto")
SEEDS = (1, 2, 3, 4, 5)
LOADS = (0.5, -1.0)


@record()
class ProcessCase:
    """One row group of the tables."""

    kind: str
    preset: str
    springs: str
    means: tuple[SeedMeans, ...]


@dataclass(frozen=True)
class _Campaign:
    """A cell that is measured anew for every seed."""

    folder: Path
    kind: str
    preset: str

    def cases(self) -> list[ProcessCase]:
        cell = self.folder / "cell" / "cell.yaml"
        init(cell.parent, kind=self.kind)
        text = cell.read_text(encoding="utf-8")
        changed = text.replace("preset: typical", f"preset: {self.preset}")
        cell.write_text(changed.replace("preset: kind", f"preset: {self.preset}"), encoding="utf-8")
        plan(cell, out=self.folder / "plan", compare=None)
        for seed in SEEDS:
            made = self.folder / f"run{seed}"
            run(cell, plan=self.folder / "plan", out=made, seed=seed)
            tool(made, out=self.folder / f"tool{seed}.json")
        return [self._case(cell, springs) for springs in SPRINGS]

    def _case(self, cell: Path, springs: str) -> ProcessCase:
        models = tuple(self.folder / f"{springs}{seed}.json" for seed in SEEDS)
        for seed, model in zip(SEEDS, models, strict=True):
            calibrate(self.folder / f"run{seed}" / "dataset.nc", out=model, springs=springs)
        found = simulate_process(
            cell, kind=self.kind, models=models, seeds=SEEDS, loads=LOADS,
            tools=tuple(self.folder / f"tool{seed}.json" for seed in SEEDS),
            out=self.folder / f"process-{springs}",
        )  # fmt: skip
        return ProcessCase(self.kind, self.preset, springs, found.means)


def quoted() -> list[ProcessCase]:
    """Return the cases as they are written down."""
    data = json.loads(QUOTED.read_text(encoding="utf-8"))
    return [from_data(ProcessCase, case, QUOTED.name) for case in data]


def measure() -> list[ProcessCase]:
    """Return all cases, measured anew."""
    cases: list[ProcessCase] = []
    for kind in KINDS:
        for preset in PRESETS:
            with tempfile.TemporaryDirectory() as folder:
                cases += _Campaign(Path(folder), kind, preset).cases()
    return cases


def write(cases: list[ProcessCase]) -> None:
    """Write cases down."""
    text = json.dumps([to_data(case) for case in cases], indent=1)
    QUOTED.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    write(measure())
