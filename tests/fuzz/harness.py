"""Run commands on damaged files and with absurd options, and judge how they end.

A case is a kind of file, a command that reads it, and mutations, each with the seed of its
generator: `Case.drawn` makes one from a number, `corpus.json` holds those that once fell.
Commands run in a child process that is forked from this one, with what they print to the
descriptors of standard output and error caught, memory limited, and stopped when they hang.

``python -m fuzz.harness --cases 10000 --seed 1 [--kind model]`` from ``tests`` (``make fuzz``)
prints how many cases of each kind ended how, and those that fell as lines for the corpus.
"""

import argparse
import collections
import functools
import gc
import importlib
import io
import json
import os
import pkgutil
import random
import re
import resource
import select
import shutil
import signal
import sys
import tempfile
import time
import warnings
import webbrowser
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from unittest import mock

import typer

import elastocal
from elastocal.cli import main
from fuzz.mutations import BYTES, FORMS, NUMBERS, TEXTS, UNREADABLE
from fuzz.seeds import KINDS, make_seeds

LONGEST = 10.0
"""In s of a processor, of one case."""
_PATIENCE = 60 * LONGEST
"""In s, until a child that says nothing and does nothing is taken for one that waits for ever."""
MOST_MEMORY = 1 << 30
"""In bytes, beside what this process has before."""
_BATCH = 250
"""Cases of one child."""
_NOISE = re.compile(
    r"^(\S+:\d+: )?\w*Warning: |^(Error|Warning): |HDF5-DIAG|^\s+at line \d+ in ", re.M
)
"""What NumPy, urdfdom and HDF5 print by themselves."""


_LINKS = re.compile(r"^(whole|broken|not signed|not verifiable) +[^:\n]+: .*\n", re.M)
"""What verify prints before its reason: a line a link."""
_QUESTION = re.compile(r"\A(?:.*\n){1,3}(?=elastocal: nobody answers)")
"""What new prints before its reason, where it asks: how to answer, and the first question."""


@dataclass(frozen=True)
class Case:
    """A file of a kind, damaged, and a command that reads it; or options of a command."""

    kind: str
    command: str
    """As in `KINDS`; ``{f}`` is the file, ``{s}`` the folder of the seeds, ``{o}`` a new one."""
    mutations: tuple[tuple[str, int], ...] = ()
    """Names of mutations in their order, each with its seed."""

    @classmethod
    def drawn(cls, kind: str, number: int) -> "Case":
        """Return a case of a kind; the same number gives the same case."""
        rng = random.Random(f"{kind} {number}")
        if kind == "options":
            return cls(kind, _absurd_command(rng))
        known = KINDS[kind]
        first, *others = known.commands
        command = rng.choice(others) if others and rng.random() < known.others else first
        names = list(FORMS[known.form])
        count = rng.choice((1, 1, 1, 2, 3))
        # What needs a file that can be read comes first.
        chosen = sorted(
            rng.choices(names, k=count), key=lambda name: (name in BYTES, "bomb" in name)
        )
        return cls(kind, command, tuple((name, rng.getrandbits(31)) for name in chosen))

    def arguments(self, seeds: Path, folder: Path) -> list[str]:
        """Write the damaged file into a folder and return the words of the command."""
        places = {"s": str(seeds), "o": str(folder / "out"), "f": ""}
        if self.kind in KINDS:
            known = KINDS[self.kind]
            for name in known.beside:
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                os.link(seeds / name, folder / name)
            file = folder / known.file
            file.unlink(missing_ok=True)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(self.content((seeds / known.file).read_bytes()))
            places["f"] = str(file)
        words = json.loads(self.command) if self.command.startswith("[") else self.command.split()
        return [re.sub(r"\{([sfo])\}", lambda hit: places[hit[1]], word) for word in words]

    def content(self, data: bytes) -> bytes:
        """Return the content of a valid file with the mutations."""
        form = FORMS[KINDS[self.kind].form]
        for name, seed in self.mutations:
            try:
                data = form[name](data, random.Random(seed))
            except UNREADABLE:
                continue  # an earlier mutation left nothing that this one knows
        return data


@dataclass(frozen=True)
class Verdict:
    """How a case ended."""

    case: Case
    word: str
    """``ok``, or what fell: ``traceback``, ``exception ignored``, ``noise``, ``lines``, ``code``,
    ``hang``, ``crash``, ``memory`` or ``half-written``."""
    code: int = 0
    seconds: float = 0.0
    megabytes: float = 0.0
    text: str = ""
    """What it printed to standard error."""


_ABSURD = (
    *TEXTS,
    *(str(number)[:400] for number in NUMBERS),
    "0,0",
    "1 m,2 m",
    "0 mm, 0 mm, 1e300 m",
    "nan,nan",
    "1,0,0",
    "0,inf",
    "1e308 m, 0 m, 0 m, 0 deg, 0 deg, 1e308 deg",
    "1/0",
    "70/30",
    "0/0",
    "99999999999/1",
    "springs=a[/b]",
    "search=",
    "=",
    "poses=1e9",
    "5 %, 5 um",
    "-1 %, nan um",
    "a.yaml",
    "out/b.svg",
    "0:a[/b]",
)


def _absurd_command(rng: random.Random) -> str:
    """Return the words of a command with one or two absurd options or arguments, as JSON."""
    name = rng.choice([*list(PLAIN)] + 12 * [each for each in PLAIN if each not in _SLOW])
    words = PLAIN[name].split()
    command = _commands().get_command(None, name)
    options = [
        each
        for each in command.params
        if each.param_type_name == "option" and not {"--help", "--for"} & set(each.opts)
    ]
    for _ in range(rng.choice((1, 1, 2))):
        if rng.random() < 0.15 and len(words) > 1:
            words[rng.randrange(1, len(words))] = rng.choice(_ABSURD)
            continue
        option = rng.choice(options)
        value = [] if option.is_flag else [rng.choice(_ABSURD)]
        if value and rng.random() < 0.4:
            value = [str(rng.choice(NUMBERS))[:400]]
        words += [rng.choice(option.opts), *value]
    return json.dumps([word.replace("\0", "").encode("utf-8", "ignore").decode() for word in words])


_SLOW = (
    "init",
    "plan",
    "codec",
    "tool",
    "stiffness",
    "simulate-process",
    "report",
    "study",
    "import",
    "derive",
    "plan-pair",
    "calibrate-pair",
)
"""Commands that take a second or more: drawn seldom."""
PLAIN = {
    "robots": "robots",
    "init": "init {o}",
    "check": "check {s}/tool.json",
    "plan": "plan {s}/cell.yaml --out {o} --dry-run",
    "run": "run {s}/cell.yaml --plan {s}/plan --out {o} --dry-run",
    "calibrate": "calibrate {s}/dataset.nc --out {o}.json --draws 40",
    "codec": "codec {s}/dataset.nc --compare springs=actuated,bearing --splits 1 --out {o}",
    "predict": "predict {s}/model.json {s}/rows.csv --out {o}.csv",
    "tool": "tool {s}/postures.csv --out {o}.json",
    "compensate": "compensate {s}/model.json {s}/path.csv --out {o}.csv",
    "stiffness": "stiffness {s}/model.json {s}/path.csv --stands 1 --stations 2 --out {o}",
    "export": "export {s}/model.json --c {o}",
    "simulate-process": "simulate-process {s}/cell.yaml --model {s}/model.json --out {o}",
    "compare": "compare {s}/old.json {s}/model.json",
    "report": "report {s}/model.json --out {o}.html",
    "geometry": "geometry {s}/positions.csv --robot {s}/arm.urdf --tcp flange --draws 40"
    " --out {o}.json",
    "import": "import {s}/controller.csv {s}/force.csv {s}/tracker.txt --map {s}/map.yaml"
    " --out {o}.nc",
    "verify": "verify {s}/report.html",
    "krc-config": "krc-config {s}/kuka.yaml --out {o}",
    "measure-delay": "measure-delay {s}/kuka.yaml --out {o}.json",
    "release": "release {s}/cell.yaml",
    "touch": "touch {s}/cell.yaml --cold {s}/run --out {o}.json",
    "watch": "watch {s}/cell.yaml --for=0.5s",
    "live": "live {s}/kuka.yaml --model {s}/model.json --duration 1",
    "simulate": "simulate {s}/cell.yaml --devices net_ft --ports {o}.json",
    "studio": "studio {s}/cell.yaml --no-browser",
    "new": "new --out {o}.yaml --mesh {s}/dome.stl --no-browser --no-ask",
    "study": "study {s}/cell.yaml --out {o} --samples 1 --verification 5",
    "plan-pair": "plan-pair {s}/pair.yaml --out {o}.json",
    "simulate-pair": "simulate-pair {s}/pair.yaml --plan {s}/pair_plan.json --out {o}",
    "calibrate-pair": "calibrate-pair {s}/pair.yaml {s}/left.nc {s}/right.nc --draws 40 --out {o}",
    "compensate-pair": "compensate-pair {s}/pair.yaml {s}/pair_models {s}/left_path.csv"
    " {s}/right_path.csv --out {o}",
}
"""Commands that work, to which absurd options are added; an option that stands twice: the last.

How long to watch is left as it is: 1e308 seconds are a wish like any other, and after a nanosecond
no device has been heard, which is said in a line each."""


def run_cases(
    cases: Iterable[Case], seeds: Path, seconds: float = float("inf")
) -> Iterator[Verdict]:
    """Yield the verdict of each case, for as long as there is time."""
    for each in pkgutil.walk_packages(elastocal.__path__, "elastocal."):
        if "report" not in each.name and "__main__" not in each.name:
            importlib.import_module(each.name)  # once, not in each child
    _commands()
    waiting, end = collections.deque(cases), time.monotonic() + seconds
    while waiting and time.monotonic() < end:
        batch = [waiting.popleft() for _ in range(min(_BATCH, len(waiting)))]
        done = 0
        for verdict in _in_child(batch, seeds):
            done += 1
            yield verdict
            if time.monotonic() > end:
                return
        waiting.extendleft(reversed(batch[done:]))


def _in_child(batch: list[Case], seeds: Path) -> Iterator[Verdict]:
    """Yield verdicts up to the first case that hangs or ends the child."""
    with tempfile.TemporaryDirectory(prefix="fuzz-", dir=quick_place(seeds)) as place:
        reading, writing = os.pipe()
        child = os.fork()
        if not child:
            os.close(reading)
            try:
                _work(batch, seeds, Path(place), writing)
            finally:  # whatever happens, a copy of this process does not go on with its work
                os._exit(1)
        os.close(writing)
        done = 0
        try:
            with os.fdopen(reading, "rb", buffering=0) as lines:
                while done < len(batch):
                    if not _answers(child, reading):
                        yield Verdict(batch[done], "hang", seconds=LONGEST)
                        return
                    line = lines.readline()
                    if not line:
                        yield Verdict(batch[done], "crash", text=_last_words(Path(place)))
                        return
                    yield Verdict(batch[done], **json.loads(line))
                    done += 1
        finally:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)


def _answers(child: int, reading: int) -> bool:
    """Wait for the next line of a child; False when it has used up its time on a case.

    Its own time counts, not that of the clock: others may be at work on the machine.
    """
    used, patience = _processor_time(child), time.monotonic() + _PATIENCE
    while not select.select([reading], [], [], 0.2)[0]:
        if _processor_time(child) - used > 1.5 * LONGEST or time.monotonic() > patience:
            return False
    return True


def _processor_time(process: int) -> float:
    """Return the time that a process has used of a processor, in s."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def quick_place(seeds: Path) -> Path:
    """Return a folder on the disk of the seeds: they are linked, not copied."""
    # Beside the folder of the seeds: what it holds is hashed by the next test that asks for it.
    place = seeds.parent.with_name(f"{seeds.parent.name}-cases")
    place.mkdir(exist_ok=True)
    return place


def _work(batch: list[Case], seeds: Path, place: Path, writing: int) -> None:
    """Run cases one by one and write a line on each; this is the child, which never returns."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    used = _status("VmSize")
    resource.setrlimit(resource.RLIMIT_AS, (int(used + MOST_MEMORY), resource.RLIM_INFINITY))
    warnings.resetwarnings()
    for quiet in (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning):
        warnings.simplefilter("ignore", quiet)
    gc.collect()
    gc.freeze()
    out = os.open(place / "out", os.O_RDWR | os.O_CREAT)
    err = os.open(place / "err", os.O_RDWR | os.O_CREAT)
    os.dup2(out, 1)
    os.dup2(err, 2)
    sys.stdout, sys.stderr = (
        io.TextIOWrapper(
            io.FileIO(n, "w", closefd=False), "utf-8", "backslashreplace", write_through=True
        )
        for n in (1, 2)
    )
    for number, case in enumerate(batch):
        folder = place / f"case_{number}"
        folder.mkdir()
        for each in (out, err):
            os.ftruncate(each, 0)
            os.lseek(each, 0, os.SEEK_SET)
        found = _ended(case, seeds, folder, place / "err")
        os.write(writing, json.dumps(found).encode() + b"\n")
        shutil.rmtree(folder, ignore_errors=True)
    os._exit(0)


def _ended(case: Case, seeds: Path, folder: Path, err: Path) -> dict[str, object]:
    words = case.arguments(seeds, folder)
    os.chdir(folder)
    before, base = _listed(folder), _status("VmRSS")
    Path("/proc/self/clear_refs").write_text("5")  # the peak of the memory begins anew
    started = time.process_time()
    code = _exit_code(words)
    gc.collect()  # what a finaliser has to say belongs to this case
    seconds = time.process_time() - started
    text = err.read_bytes().decode("utf-8", "replace")
    memory = _status("VmHWM") - base
    judged = _QUESTION.sub("", _LINKS.sub("", text) if words[0] == "verify" else text)
    word = _judged(code, judged, seconds, memory)
    if word == "ok" and code and _listed(folder) != before:
        word, text = "half-written", f"{sorted(set(_listed(folder)) ^ set(before))} {text}"
    return {
        "word": word,
        "code": code,
        "seconds": seconds,
        "megabytes": memory / 1e6,
        "text": text[-3000:],
    }


def _exit_code(words: list[str]) -> int:
    # Typer builds the same commands anew at each call, which takes longer than most cases;
    # servers that would wait for Ctrl-C end at once.
    with (
        mock.patch.object(sys, "argv", ["elastocal", *words]),
        mock.patch.object(main, "app", _commands()),
        mock.patch.object(elastocal.workflows.SimulateResult, "wait", return_value=None),
        mock.patch.object(elastocal.workflows.StudioResult, "wait", return_value=None),
        mock.patch.object(webbrowser, "open", return_value=True),
    ):
        try:
            main.run()
        except SystemExit as stop:
            return stop.code if isinstance(stop.code, int) else int(stop.code is not None)
        except BaseException:  # noqa: BLE001 - whatever it is, it is what is looked for
            sys.excepthook(*sys.exc_info())
            return 1
    return 0


@functools.cache
def _commands() -> Any:
    return typer.main.get_command(main.app)


def _judged(code: int, text: str, seconds: float, memory: float) -> str:
    """Return ``ok``, or what is wrong first."""
    faults = {
        "traceback": "Traceback" in text and "Exception ignored" not in text,
        "exception ignored": "Exception ignored" in text,
        "noise": bool(_NOISE.search(text)),
        "code": code not in (0, 1, 2),
        "hang": seconds > LONGEST,
        "memory": memory > MOST_MEMORY or "not enough memory" in text,
        "lines": code == 1 and (text.count("\n") != 1 or not text.startswith("elastocal: ")),
    }
    return next((word for word, is_so in faults.items() if is_so), "ok")


def _listed(folder: Path) -> dict[str, tuple[int, int]]:
    """Return size and time of each file in a folder."""
    return {
        str(path.relative_to(folder)): (path.stat().st_size, path.stat().st_mtime_ns)
        if path.is_file()
        else (0, 0)
        for path in folder.rglob("*")
    }


def _status(key: str) -> float:
    """Return a figure of this process's memory, in bytes."""
    found = re.search(rf"^{key}:\s+(\d+) kB", Path("/proc/self/status").read_text(), re.M)
    assert found is not None
    return float(found[1]) * 1024


def _last_words(place: Path) -> str:
    return (place / "err").read_bytes().decode("utf-8", "replace")[-2000:]


def drawn_cases(count: int, seed: int, kinds: Iterable[str] = ()) -> Iterator[Case]:
    """Yield cases of all kinds, as many of each as its share says."""
    chosen = list(kinds) or [*KINDS, "options"]
    shares = [KINDS[kind].share if kind in KINDS else 1.0 for kind in chosen]
    rng = random.Random(seed)
    for number in range(count):
        yield Case.drawn(rng.choices(chosen, shares)[0], seed * 1_000_000 + number)


def _main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=float("inf"))
    parser.add_argument("--kind", action="append", default=[])
    parser.add_argument(
        "--others", action="store_true", help="not the usual command of a kind: the others"
    )
    parser.add_argument(
        "--show", default="", help="a case as the corpus has it: print what it says"
    )
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        seeds = Path(folder) / "seeds"
        make_seeds(seeds)
        cases = drawn_cases(given.cases, given.seed, given.kind)
        if given.others:
            cases = (
                case
                for case in cases
                if case.kind == "options" or case.command != KINDS[case.kind].commands[0]
            )
        if given.show:
            cases = iter([Case(**json.loads(given.show))])
        _report(run_cases(cases, seeds, given.seconds), bool(given.show))


def _report(verdicts: Iterable[Verdict], show: bool) -> None:
    table: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
    spent: collections.Counter[str] = collections.Counter()
    for verdict in verdicts:
        table[verdict.case.kind][verdict.word] += 1
        spent[verdict.case.kind] += verdict.seconds
        if verdict.word != "ok" or show:
            last = verdict.text.strip().splitlines() or [""]
            told = "\n".join(last) if show else last[-1][:300]
            print(
                f"{verdict.word} [{verdict.code}] {verdict.seconds:.1f} s"
                f" {verdict.megabytes:.0f} MB: {told}"
            )
            print(f"   {json.dumps(asdict(verdict.case))}", flush=True)
    words = sorted({word for counts in table.values() for word in counts})
    print(f"{'kind':14}", *(f"{word:>10.10}" for word in words), f"{'ms a case':>10}")
    for kind, counts in sorted(table.items()):
        per = 1e3 * spent[kind] / counts.total()
        print(f"{kind:14}", *(f"{counts[word]:10}" for word in words), f"{per:10.1f}")
    total = sum(table.values(), collections.Counter())
    print(f"{'all':14}", *(f"{total[word]:10}" for word in words), f"{sum(spent.values()):9.1f}s")


if __name__ == "__main__":
    _main()
