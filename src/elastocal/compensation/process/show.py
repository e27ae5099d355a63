"""Show a simulated process as blocks for every shell: the paper's Table 1 beside the paper's.

Published figures are shown beside those of the same measure, with a note on what they contain.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from elastocal.blocks import Block, Bullets, Facts, Paragraph, Row, Table
from elastocal.compensation.process.result import SimulateProcessResult
from elastocal.compensation.process.statistics import (
    DeviationComparison,
    DeviationStatistics,
    SeedMean,
    SeedMeans,
)
from elastocal.units import in_unit, quantity
from elastocal.wording import Phrase, phrase, phrases, sentences


@dataclass(frozen=True)
class PublishedCase:
    """A case of the paper's Table 1, in mm and parts of 1."""

    title: str
    before: tuple[float, float, float]
    after: tuple[float, float, float]
    reduction: tuple[float, float, float]
    measures: Phrase
    """What its figures measure, in a sentence."""


PAPER = {
    "afp": PublishedCase(
        "Robotized AFP processing of a 3D thermoplastic aerostructure",
        (0.570, 0.956, 0.100), (0.061, 0.285, 0.046), (0.8930, 0.7019, 0.5400),
        phrase(
            "The paper measures the side deviation of the head by a 6D probe on the real machine:"
            " what is left there holds backlash, dynamics and servo errors beside what the model"
            " misses."
        ),
    ),
    "machining": PublishedCase(
        "Robotized roughing of an Al-7075 aerospace part",
        (0.597, 2.050, 0.725), (0.101, 0.520, 0.342), (0.8308, 0.7463, 0.5283),
        phrase(
            "The paper scans the part: before and after hold geometry, cutter, fixture and dynamics"
            " beside the elastic deviation, which is all that is simulated here."
        ),
    ),
}  # fmt: skip
"""Table 1 of Monsarrat et al., RCIM 2024: mean, maximum and standard deviation."""
_DEVIATIONS = {
    "afp": phrase("Absolute value of lateral deviation"),
    "machining": phrase("Absolute value of the error normal to the part"),
}
_SIDE_BY_SIDE = phrase(
    "The paper's figures are of its real cell, those above them of the simulated one, which counts"
    " the path under force against the same path in the air: elastic deviation and what friction,"
    " delay and sensor leave of it. They stand side by side for their size, not as a repetition;"
    " that a seed's deviation without correction is near the paper's is chance."
)
_HEADS = ("", *phrases("Mean", "Max", "St. dev."))


def show_process(found: SimulateProcessResult) -> Iterator[Block]:
    """Yield the blocks of a simulated process.

    Parameters
    ----------
    found : SimulateProcessResult
        Its table.
    """
    yield from show_deviations(found)
    if found.budget:
        yield budget_table(found)
    yield Facts(
        (
            ("process", phrase("{process} in cell {cell}", process=found.process, cell=found.cell)),
            *((("tool", found.tool),) if found.tool else ()),
            *(("truth", text) for text in _truth(found)),
            *(("note", text) for text in found.notes),
        )
    )


def show_deviations(found: SimulateProcessResult) -> Iterator[Block]:
    """Yield the deviations with the paper's, their means over seeds, and what they hold."""
    paper = PAPER.get(found.process)
    yield _deviation_table(found, paper)
    if len(found.runs) > 1 and found.means:
        yield _means_table(found.means)
    if paper is not None:
        yield Paragraph(sentences([_SIDE_BY_SIDE, paper.measures]), "sub")
    if found.posture is not None:
        yield Paragraph(phrase("Posture: {sentence}.", sentence=found.posture.sentence), "sub")


def show_notes(found: SimulateProcessResult) -> Bullets:
    """Return the preset of the truth and the notes; coverage is shown elsewhere."""
    covered = "" if found.coverage is None else found.coverage.sentence()
    return Bullets((*_truth(found), *(note for note in found.notes if note != covered)), "sub")


def _deviation_table(table: SimulateProcessResult, paper: PublishedCase | None) -> Table:
    """Return before, after and reduction of every line, and those of the paper."""
    deviation = _DEVIATIONS.get(
        table.process, phrase("Absolute deviation, {direction}", direction=table.direction)
    )
    spatial = phrase("3-D deviation")
    own = [(deviation, line.name, line) for line in table.lines]
    others = [(spatial, line.name, line) for line in table.spatial[-1:]]
    for each in table.loads:
        text = phrase(
            "at {load} of the load, {name}", load=f"{each.load:g}", name=each.lines[-1].name
        )
        others += [(deviation, text, each.lines[-1]), (spatial, text, each.spatial[-1])]
    if table.posture is not None:
        text = phrase("in the programmed posture")
        others += [(deviation, text, table.posture.lines[-1])]
        others += [(spatial, text, table.posture.spatial[-1])]
    # The paper's rows have the same component and load as those above them.
    rows = [row for line in own for row in _rows(*line)]
    if paper is not None:
        rows += [
            (
                phrase("Paper, without correction in mm"),
                *(f"{value:.3f}" for value in paper.before),
            ),
            (phrase("Paper, with correction in mm"), *(f"{value:.3f}" for value in paper.after)),
            (phrase("Paper, reduction"), *(f"{share:.2%}" for share in paper.reduction)),
        ]
    rows += [row for line in others for row in _rows(*line)]
    return Table(_title(paper), _HEADS, tuple(rows))


def _rows(what: Phrase, name: str, line: DeviationComparison) -> tuple[Row, ...]:
    """Return a line of the table as three rows: before, after, reduction."""
    title = phrase(
        "{what}, {name} ({points} points), without correction in mm",
        what=what,
        name=_run_name(name),
        points=line.points,
    )
    return (
        (title, *_mm(line.before)),
        (phrase("With correction in mm"), *_mm(line.after)),
        (phrase("Reduction"), *(f"{share:.2%}" for share in _three(line.reduction))),
    )


def _run_name(name: str) -> str:
    """Return the name of a line of the file as a phrase, where it is the seed of a run."""
    word, _, number = name.partition(" ")
    return phrase("seed {seed}", seed=number) if word == "seed" and number.isdecimal() else name


def _title(paper: PublishedCase | None) -> Phrase:
    if paper is None:
        return phrase("Deviation from the path")
    return phrase(
        "Deviation from the path; “paper” is Table 1 of Monsarrat et al., Robotics and"
        " Computer-Integrated Manufacturing, 2024"
    )


def _means_table(means: tuple[SeedMeans, ...]) -> Table:
    heads = ("", *phrases("Mean, before to after in mm", "Reduction", "Max, before to after in mm",
                          "Reduction"))  # fmt: skip
    rows = tuple(
        (
            each.title,
            _change(each.mean_before.mean, each.mean_after.mean),
            _with_interval(each.mean_reduction),
            _change(each.max_before.mean, each.max_after.mean),
            _with_interval(each.max_reduction),
        )
        for each in means
    )
    caption = phrase(
        "Means over {seeds} seeds, 95 % interval (Student's t over the seeds)",
        seeds=means[0].seeds,
    )
    return Table(caption, heads, rows)


def _change(before: float, after: float) -> Phrase:
    return phrase(
        "{low} to {high}", low=f"{in_unit(before, 'mm'):.3f}", high=f"{in_unit(after, 'mm'):.3f}"
    )


def _with_interval(figure: SeedMean) -> str:
    if figure.low is None or figure.high is None:
        return f"{figure.mean:.1%}"
    return phrase(
        "{value} ({low} to {high})",
        value=f"{figure.mean:.1%}",
        low=f"{figure.low:.1%}",
        high=f"{figure.high:.1%}",
    )


def _truth(table: SimulateProcessResult) -> Iterator[Phrase]:
    """Yield how hard the truth was, where the file says it."""
    if not table.preset:
        return
    reacts = table.process_stiffness
    forces = (
        phrase(
            "process forces react to the tool's shift along the surface's normal, by {rate}",
            rate=quantity(reacts, "N/mm"),
        )
        if reacts
        else phrase("process forces are given, they do not react to the tool's shift")
    )
    yield phrase(
        "How hard the simulated robot was to calibrate: preset “{preset}”; {forces}.",
        preset=table.preset,
        forces=forces,
    )


def budget_table(found: SimulateProcessResult) -> Table:
    """Return the table of the error budget: the deviation after each of its parts."""
    rows = tuple(
        (
            line.name,
            *(
                phrase("{change} ({share})", change=_change(b, a), share=f"{r:.1%}")
                for b, a, r in zip(
                    _three(line.before), _three(line.after), _three(line.reduction), strict=True
                )
            ),
        )
        for line in found.budget
    )
    caption = phrase("Error budget of the first seed, before to after in mm (reduction)")
    return Table(caption, _HEADS, rows)


def _three(values: DeviationStatistics) -> tuple[float, float, float]:
    return values.mean, values.max, values.standard_deviation


def _mm(values: DeviationStatistics) -> tuple[str, ...]:
    return tuple(f"{in_unit(value, 'mm'):.3f}" for value in _three(values))
