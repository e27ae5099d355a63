"""Fill pages with Table 1 over truths, seeds and campaigns: ``<!-- process table: afp -->``.

The figures stand in ``gallery/process_figures.json``, which ``make process-figures`` measures; the
paper's row comes from the report's own copy of it. ``<!-- process campaigns: afp -->`` becomes the
table of shorter campaigns, ``<!-- process touched: afp -->`` that of touches before production,
``<!-- process procedures: afp -->`` what every procedure beside the springs costs and brings,
``<!-- process instruments: afp -->`` what is reached without a tracker, and with encoders,
``<!-- process summary: typical -->`` the sentences that the README has,
``<!-- process demos: typical -->`` what every example cell reaches on a truth (``all``: on each).
"""

import json
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from elastocal.compensation.process import PAPER, PublishedCase, SeedMean

if TYPE_CHECKING:
    from mkdocs.structure.pages import Page

_QUOTED = Path(__file__).parent / "gallery" / "process_figures.json"
_MARK = re.compile(
    r"<!-- process (table|campaigns|touched|procedures|instruments|summary|short|demos): (\S+) -->"
)
_HEAD = ("truth", "springs (taken)", "left-out error, µm", "deviation",
         "mean, mm", "reduction, %", "max, mm", "reduction, %", "seeds")  # fmt: skip
_CAMPAIGNS = ("campaign", "springs", "poses", "minutes in the cell", "left-out error, µm",
              "left of the mean, µm", "reduction, %", "seeds")  # fmt: skip
_TOUCHED = ("truth", "correction", "minutes before production", "reduction of the mean, %",
            "3-D, %", "at half load, %", "seeds")  # fmt: skip
_PROCEDURES = ("truth", "procedure", "time in the cell beyond springs alone",
               "mean, %", "3-D, %", "half load, %", "seeds")  # fmt: skip
_INSTRUMENTS = ("measured by", "springs", "minutes in the cell", "reduction of the mean, %",
                "3-D, %", "at half load, %", "3-D, at half load, %", "seeds")  # fmt: skip
INSTRUMENTS = {
    "template": "tracker",
    "no tracker": "no tracker, disk doubled",
    "encoders fitted": "tracker and encoders",
    "encoders read": "encoders in production too",
}
"""What measures, by the name of its campaign."""
TOUCHED = "touched"
"""Name of the campaign whose growth was touched."""
MORE = {
    TOUCHED: "touches, cold and warm",
    "conditioned": "press before every reference",
    "course offset": "press before every reference, and the offset of each course",
    "touched and offset": "touches, press, and the offset of each course",
}
"""Procedures beside the springs, by the name of their campaign."""
_README = Path(__file__).parents[2] / "README.md"
_NAMES = {"afp": "fibre placement", "machining": "roughing"}
TRUTHS = ("kind", "typical", "harsh")
_DEMO_HEAD = ("cell", "truth", "mean, mm", "reduction, %", "max, mm", "reduction, %", "seeds")
Figures = dict[str, Any]


@dataclass(frozen=True)
class Demo:
    """An example cell, and the length that is counted on it."""

    name: str
    counted: str


DEMOS = {
    "afp": Demo("Fibre placement", "deviation aside of the course"),
    "machining": Demo("Roughing", "deviation normal to the part"),
    "ur20": Demo("UR20 on a block", "deflection at left-out poses"),
}
"""By the word that `init --like` takes, in the order of the figure."""


def on_page_markdown(markdown: str, page: "Page", **_: object) -> str:  # noqa: ARG001 (mkdocs')
    """Return the page with the tables in place of their marks."""
    made: dict[str, Callable[[str], str]] = {
        "table": table, "campaigns": campaigns, "touched": touched,
        "procedures": procedures, "instruments": instruments, "summary": summary, "short": short,
        "demos": demos,
    }  # fmt: skip
    return _MARK.sub(lambda mark: made[mark[1]](mark[2]), markdown)


def table(kind: str) -> str:
    """Return Table 1 of a process: truths, springs, measures, and the paper's row."""
    found = [each for each in quoted() if each["campaign"] == "template"]
    rows = [
        row
        for truth in TRUTHS
        for springs in ("bearing", "auto")
        for row in _rows(_of(found, kind, truth, springs=springs))
    ]
    paper = PAPER[kind]
    own = (
        "paper", "18 springs", "", "Table 1", *_published(paper), "",
    )  # fmt: skip
    return f"{_markdown(_HEAD, [*rows, own])}\n\n{_INTERVALS} {paper.measures}"


_INTERVALS = (
    "Means over the seeds that the last column counts, in brackets their 95 % interval (Student's"
    " t); of one seed there is none, and of two both are given."
)


def campaigns(kind: str) -> str:
    """Return what shorter campaigns reach on the typical truth, on the seeds that all have."""
    others = MORE.keys() | INSTRUMENTS.keys() - {"template"}
    found = [each for each in _of(quoted(), kind, "typical") if each["campaign"] not in others]
    seeds_of: dict[str, set[int]] = {}
    for each in found:
        seeds_of.setdefault(each["campaign"], set()).add(each["case"]["seed"])
    common = set.intersection(*seeds_of.values()) if seeds_of else set()
    found = [each for each in found if each["case"]["seed"] in common]
    rows = []
    for (name, springs), some in groupby(found, lambda each: (each["campaign"], each["springs"])):
        seeds = list(some)
        lateral = [_deviation(each, 1.0) for each in seeds]
        poses, minutes = ({each[key] for each in seeds} for key in ("poses", "minutes"))
        rows.append((
            "as `init` writes it" if name == "template" else f"`{name.split()[0]}`",
            f"`{springs}`", _span(poses, "d"), _span(minutes, ".1f"),
            _mean([1e6 * each["left_out"] for each in seeds], ".0f"),
            _mean([1e6 * each["mean"][1] for each in lateral], ".0f"),
            _percent([_reduction(each["mean"]) for each in lateral]), str(len(seeds)),
        ))  # fmt: skip
    return _markdown(_CAMPAIGNS, rows)


def touched(kind: str) -> str:
    """Return what touches before production bring, on the seeds that were run with and without."""
    rows = []
    for truth in TRUTHS:
        pairs = [
            {each["case"]["seed"]: each for each in _of(quoted(), kind, truth, **which)}
            for which in ({"campaign": "template", "springs": "auto"}, {"campaign": TOUCHED})
        ]
        seeds = sorted(pairs[0].keys() & pairs[1].keys())
        if not seeds:
            continue
        for name, found in zip(("springs alone", "touched"), pairs, strict=True):
            some = [found[seed] for seed in seeds]
            minutes = {each.get("touch_minutes") or 0.0 for each in some}
            rows.append((truth, name, _span(minutes, ".1f"), *_reductions(some)))
    return _markdown(_TOUCHED, rows)


def procedures(kind: str) -> str:
    """Return what each procedure costs and brings, on the seeds that were run with and without.

    Springs alone stand once before the procedures that were run on the same seeds.
    """
    rows: list[tuple[str, ...]] = []
    for truth in TRUTHS:
        alone, told = _by_seed(kind, truth, campaign="template", springs="auto"), []
        for name, title in MORE.items():
            found = _by_seed(kind, truth, campaign=name)
            seeds = sorted(alone.keys() & found.keys())
            pairs = [(alone[seed], found[seed]) for seed in seeds]
            if pairs and seeds != told:
                told = seeds
                rows.append((truth, "springs alone", "", *_reductions(side[0] for side in pairs)))
            if pairs:
                rows.append((truth, title, _cost(pairs), *_reductions(side[1] for side in pairs)))
    return _markdown(_PROCEDURES, rows)


def _reductions(runs: Iterable[Figures]) -> list[str]:
    """Return the reductions of the mean, in space and at half load, and the number of seeds."""
    some = list(runs)
    cells = [
        _percent([_reduction(_measure(each, which, load)["mean"]) for each in some])
        for which, load in ((0, 1.0), (1, 1.0), (0, 0.5))
    ]
    return [*cells, str(len(some))]


def instruments(kind: str) -> str:
    """Return what each instrument reaches on the typical truth, on the seeds that all have."""
    found = {
        (name, springs): _by_seed(kind, "typical", campaign=name, springs=springs)
        for name in INSTRUMENTS
        for springs in ("bearing", "auto")
    }
    seeds = sorted(set.intersection(*(set(each) for each in found.values())))
    rows = []
    for (name, springs), by_seed in found.items():
        some = [by_seed[seed] for seed in seeds]
        if some:
            cells = [
                _percent([_reduction(_measure(each, which, load)["mean"]) for each in some])
                for load in (1.0, 0.5)
                for which in (0, 1)
            ]
            minutes = _span({each["minutes"] for each in some}, ".1f")
            rows.append((INSTRUMENTS[name], f"`{springs}`", minutes, *cells, str(len(some))))
    return _markdown(_INSTRUMENTS, rows)


def _by_seed(kind: str, truth: str, **which: str) -> dict[int, Figures]:
    return {each["case"]["seed"]: each for each in _of(quoted(), kind, truth, **which)}


def _cost(pairs: list[tuple[Figures, Figures]]) -> str:
    """Return what a procedure takes of the cell's time more than springs alone."""
    campaign = {round(with_it["minutes"] - alone["minutes"], 1) for alone, with_it in pairs}
    touches = {found for _, each in pairs if (found := each.get("touch_minutes"))}
    landings = {found for _, each in pairs if (found := each.get("landing_seconds"))}
    parts = [
        f"{_span(campaign, '.1f')} min in the campaign" if any(campaign) else "",
        f"{_span(touches, '.1f')} min before production" if touches else "",
        f"{_span(landings, '.1f')} s a course" if landings else "",
    ]
    return ", ".join(part for part in parts if part)


def _measure(figures: Figures, which: int, load: float) -> Figures:
    """Return the component that counts (0) or the 3-D deviation (1), at a load."""
    found: Figures = [each for each in figures["deviations"] if each["load"] == load][which]
    return found


def demos(preset: str) -> str:
    """Return what every example cell reaches on a truth, or on all, and the paper's rows."""
    rows = []
    for kind, demo in DEMOS.items():
        for truth in TRUTHS if preset == "all" else (preset,):
            seeds = _of(quoted(), kind, truth, campaign="template", springs="auto")
            own = [each["deviations"][0] for each in seeds]
            cells = [cell for key in ("mean", "max") for cell in _before_and_after(own, key)]
            if seeds:
                rows.append((demo.name, truth, *cells, str(len(seeds))))
        if kind in PAPER:
            rows.append((demo.name, "paper", *_published(PAPER[kind]), ""))
    return _markdown(_DEMO_HEAD, rows)


def summary(preset: str = "typical") -> str:
    """Return the figures of a truth in sentences, beside those of the paper."""
    return " ".join(_sentence(kind, preset) for kind in _NAMES)


def short(preset: str) -> str:
    """Return a list of where a correction takes less of the mean than the paper's does."""
    found = []
    for kind, name in _NAMES.items():
        seeds = _of(quoted(), kind, preset, campaign="template", springs="auto")
        paper = abs(PAPER[kind].reduction[0])
        rows = zip(*(each["deviations"] for each in seeds), strict=True)
        below = [
            f"{_title(own[0])} ({taken:.1%})"
            for own in rows
            for taken in [sum(_reduction(each["mean"]) for each in own) / len(own)]
            if taken < paper
        ]
        if seeds:
            found.append(f"* {name}, `{preset}`: {'; '.join(below) or 'none'}")
    return "\n".join(found)


def renew_readme() -> None:
    """Write the summary into the README, in place of the one that is there."""
    text = _README.read_text(encoding="utf-8")
    new = re.sub(r"(?m)^(On the|The) typical truth .*$", lambda _: summary(), text)
    _README.write_text(new, encoding="utf-8")


def _sentence(kind: str, preset: str) -> str:
    seeds = _of(quoted(), kind, preset, campaign="template", springs="auto")
    if not seeds:
        return f"The {preset} truth was not measured in {_NAMES[kind]}."
    lateral, paper = [_deviation(each, 1.0) for each in seeds], PAPER[kind].reduction
    mean, largest = (
        _mean([_reduction(each[key]) for each in lateral], ".1%") for key in ("mean", "max")
    )
    return (
        f"On the {preset} truth the correction takes {mean} of the mean deviation in"
        f" {_NAMES[kind]}, and {largest} of the largest, over {_counted(len(seeds))}"
        f" (the paper, on a real robot: {abs(paper[0]):.2%} and {abs(paper[1]):.2%})."
    )


def quoted() -> list[Figures]:
    """Return the figures as they are written down, those of one table row behind one another."""
    found: list[Figures] = json.loads(_QUOTED.read_text(encoding="utf-8"))
    order = list(dict.fromkeys((each["campaign"], each["springs"]) for each in found))
    return sorted(
        found, key=lambda each: (order.index((each["campaign"], each["springs"])), *_case(each))
    )


def _case(figures: Figures) -> tuple[str, int]:
    return figures["case"]["kind"], figures["case"]["seed"]


def _of(found: list[Figures], kind: str, preset: str, **others: str) -> list[Figures]:
    return [
        each
        for each in found
        if each["case"]["kind"] == kind
        and each["case"]["preset"] == preset
        and all(each[key] == value for key, value in others.items())
    ]


def _rows(seeds: list[Figures]) -> list[tuple[str, ...]]:
    """Return a row for each measure at each load, of the same model over seeds.

    What they have in common stands in the first of them alone.
    """
    if not seeds:
        return []
    first = seeds[0]
    chosen = sorted({each["chosen"] for each in seeds})
    springs = f"`{first['springs']}`"
    if chosen != [first["springs"]]:
        springs += f" ({', '.join(f'`{each}`' for each in chosen)})"
    left_out = _mean([1e6 * each["left_out"] for each in seeds], ".0f")
    rows = []
    for number, own in enumerate(first["deviations"]):
        some = [each["deviations"][number] for each in seeds]
        cells: list[str] = []
        for key in ("mean", "max"):
            cells += _before_and_after(some, key)
        common = ("", "", "") if rows else (first["case"]["preset"], springs, left_out)
        rows.append((*common, _title(own), *cells, str(len(seeds))))
    return rows


def _before_and_after(deviations: list[Figures], key: str) -> tuple[str, str]:
    """Return means over seeds before and after correction in mm, and the reduction."""
    before, after = (sum(each[key][k] for each in deviations) / len(deviations) for k in (0, 1))
    reduction = _percent([_reduction(each[key]) for each in deviations])
    return f"{1e3 * before:.3f} → {1e3 * after:.3f}", reduction


def _published(paper: PublishedCase) -> tuple[str, ...]:
    """Return mean and largest of the paper's Table 1, each with its reduction."""
    return tuple(
        cell
        for number in (0, 1)
        for cell in (
            f"{paper.before[number]:.3f} → {paper.after[number]:.3f}",
            f"{100.0 * paper.reduction[number]:.2f}",
        )
    )


def _title(deviation: Figures) -> str:
    load = "" if deviation["load"] == 1.0 else f", load {deviation['load']:g}"
    return f"{deviation['name']}{load}"


def _deviation(figures: Figures, load: float) -> Figures:
    """Return the component that counts, at a load."""
    found: Figures = next(each for each in figures["deviations"] if each["load"] == load)
    return found


def _reduction(pair: list[float]) -> float:
    return 1.0 - pair[1] / pair[0]


def _percent(shares: list[float]) -> str:
    """Return a mean in per cent, whose sign the heading has."""
    return _mean([100.0 * share for share in shares], ".1f")


def _mean(values: list[float], form: str) -> str:
    """Return a mean with its interval, both in a format; two values in place of an interval.

    Student's interval of two values is twelve times as wide as they are apart, and tells nothing.
    """
    found = SeedMean.of(values)
    if len(values) == 2:
        return f"{found.mean:{form}} ({min(values):{form}} and {max(values):{form}})"
    if found.low is None or found.high is None:
        return f"{found.mean:{form}}"
    return f"{found.mean:{form}} ({found.low:{form}} to {found.high:{form}})"


def _span(values: set[float], form: str) -> str:
    low, high = f"{min(values):{form}}", f"{max(values):{form}}"
    return low if low == high else f"{low} to {high}"


def _counted(seeds: int) -> str:
    return "one seed" if seeds == 1 else f"{seeds} seeds"


def _markdown(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = (head, ("---",) * len(head), *rows)
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
