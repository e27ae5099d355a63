"""How long a first-time user takes from the files of a foreign cell to a signed certificate.

    python benchmarks/first_use.py [irb6700 | tx2_90 ...] [--folder DIR] [--json FILE]

Writes the files that an engineer has (`tests/support/foreign_campaign.py`: URDF and STL, logs of
controller, force sensor and tracker), goes through the commands of the how-to page one by one, each
a program of its own, and prints the wall time of each. What a person writes in between, the place
of the sensor and who measured where, is edited into the files as a person would. At last the
compliances of the certificate are held against those that were planted.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from support.foreign_campaign import (
    ARMS,
    DRAWN_MARKER,
    SENSOR_HEIGHT,
    SENSOR_TURN,
    TRACKER,
    load_cases,
    write_campaign,
)

CERTIFICATE = """
acceptance: {{tolerance: "0.3 mm"}}
certificate:
  robot: {{type: "{robot}", serial: "0815"}}
  sensor: {{type: "ATI Omega160", serial: "FT12345", certificate: "K-77", uncertainty: "5 N"}}
  tracker: {{type: "AT960", serial: "750123", certificate: "K-78", uncertainty: "15 um"}}
  operator: "A. Berg"
  place: "Hall 3"
  temperature: "21.5 degC"
  date: "2026-11-20"
"""


@dataclass(frozen=True)
class Step:
    """A command and how long it took."""

    command: str
    seconds: float
    said: str


@dataclass(frozen=True)
class Spring:
    """A compliance of the certificate's model and the planted one, in rad/(N·m)."""

    name: str
    planted: float
    low: float
    high: float
    is_known: bool
    """Whether the readings determine it; what they do not has no interval to be held against."""


def run(folder: Path, *words: str) -> Step:
    """Return a command, done in a folder as a person does it.

    Raises
    ------
    SystemExit
        If it fails, with what it said.
    """
    began = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-m", "elastocal", *words],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    step = Step(words[0], time.perf_counter() - began, done.stdout + done.stderr)
    if done.returncode:
        raise SystemExit(f"elastocal {' '.join(words)}\n{step.said}")
    return step


def first_use(name: str, folder: Path) -> Iterator[Step]:
    """Yield the steps from the files of an arm to a certificate that somebody else has verified."""
    arm, cell, log_map = ARMS[name], folder / "cell.yaml", folder / "map.yaml"
    yield run(folder, "check", f"{arm.name}.urdf")
    yield run(folder, "new", "--out", "cell.yaml", "--no-ask", "--no-browser", *_answers(name))
    text = cell.read_text(encoding="utf-8")
    pose = f'{{xyz: ["0 mm", "0 mm", "{1e3 * SENSOR_HEIGHT:g} mm"], abc: ["{SENSOR_TURN:g} deg", '
    sensor = '  pose: {xyz: ["0 mm", "0 mm", "0 mm"]}'
    if sensor not in text:
        raise SystemExit("the cell file has another place for the sensor than this script expects")
    text = text.replace(sensor, f'  pose: {pose}"0 deg", "0 deg"]}}', 1)
    cell.write_text(text + CERTIFICATE.format(robot=arm.name), encoding="utf-8")
    yield run(folder, "check", "cell.yaml")
    logs = ("robot.csv", "ati.csv", "tracker.txt", "--map", "map.yaml")
    yield run(folder, "import", *logs, "--guess", "--cell", "cell.yaml")
    named = ", ".join(
        f"{case}: [{', '.join(f'{value:g} N' for value in force)}]"
        for case, force in load_cases(arm).items()
    )
    guessed = log_map.read_text(encoding="utf-8")
    log_map.write_text(f"{guessed}load_cases: {{{named}}}\n", encoding="utf-8")
    yield run(folder, "import", *logs, "--out", "data.nc")
    yield run(folder, "calibrate", "data.nc", "--out", "model.json")
    yield run(folder, "codec", "data.nc", "--out", "codec")
    yield run(folder, "verify", "--new-key", "line3.key")
    yield run(folder, "report", ".", "--out", "report.html", "--sign", "line3.key")
    yield run(folder, "verify", "report.html", "--key", "line3.key.pub")


def _answers(name: str) -> list[str]:
    """Return what an engineer answers to `elastocal new`: from drawings and a data sheet."""
    arm = ARMS[name]

    def lengths(*values: float) -> str:
        return ", ".join(f"{1e3 * value:g} mm" for value in values)

    return [
        *("--robot", f"{arm.name}.urdf", "--mesh", "tooling.stl"),
        *("--place", f"{lengths(*arm.place)}, 0 deg, 0 deg, 0 deg"),
        *("--tcp", f"{lengths(0, 0, arm.tcp)}, 0 deg, 0 deg, 0 deg"),
        *("--tool-mass", f"{arm.tool[0]:g} kg", "--tool-centre", lengths(*arm.tool[1])),
        *("--press", f"{arm.press:g} N", "--tracker", lengths(*TRACKER)),
        *("--marker", lengths(*DRAWN_MARKER), "--poses", "12"),
    ]


def springs(name: str, folder: Path) -> list[Spring]:
    """Return the joints' compliances by the model file, beside the planted ones."""
    model = json.loads((folder / "model.json").read_text(encoding="utf-8"))
    found = {each["name"]: each for each in model["calibration"]["springs"]}
    planted = zip(range(1, 7), ARMS[name].compliance, strict=True)
    return [
        Spring(each["name"], value, each["low"], each["high"], each["observable"])
        for number, value in planted
        if (each := found.get(f"joint_{number}.axial")) is not None
    ]


def main() -> None:
    """Go through the first use of the arms that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("arms", nargs="*", default=["irb6700"], help=", ".join(ARMS))
    parser.add_argument("--folder", type=Path, help="where to; default: one that is removed")
    parser.add_argument("--json", type=Path, help="figures as JSON")
    parser.add_argument("--masses", action="store_true", help="give the URDF masses")
    chosen = parser.parse_args()
    figures = {}
    with tempfile.TemporaryDirectory() as scratch:
        for name in chosen.arms:
            folder = (chosen.folder or Path(scratch)) / name
            write_campaign(name, folder, masses=chosen.masses)
            steps = []
            for step in first_use(name, folder):
                steps.append(step)
                print(f"{name}  {step.command:10}{step.seconds:7.1f} s", flush=True)
            print(f"{name}  {'together':10}{sum(step.seconds for step in steps):7.1f} s")
            print(steps[-2].said, steps[-1].said, sep="\n")
            known = springs(name, folder)
            for each in known:
                low, value, high = (1e6 * v for v in (each.low, each.planted, each.high))
                print(f"{name}  {each.name}: {value:.3f} planted, {low:.3f} to {high:.3f}")
            figures[name] = {
                "steps": [asdict(step) for step in steps],
                "springs": [asdict(each) for each in known],
            }
    if chosen.json:
        chosen.json.write_text(json.dumps(figures, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
