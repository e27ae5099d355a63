"""The figures of a codec: on paper, and on one HTML page to explore (paper Fig. 7, 9, 10)."""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

from matplotlib.figure import Figure

from elastocal.blocks import Block, Bullets, Details, Table
from elastocal.codec import (
    INDICES,
    CodecAnalysis,
    CodecData,
    Correlation,
    SpringObservability,
    Verdicts,
    codec_summary,
    error_table,
    split_facts,
)
from elastocal.files import write_text
from elastocal.findings import group_alike
from elastocal.parallel import map_in_processes, process_count
from elastocal.report.pages.templating import render
from elastocal.report.plots import (
    INDEX_NAMES,
    KIND_TITLES,
    check_indices,
    codec_chart,
    compliance_chart,
    compliance_views,
    error_views,
    headline,
    how_to_read,
    index_chart,
    variant_styles,
    write_figure,
)

PAGE = "codec.html"
_MOST_PAIRS = 3
"""Pairs of variants that are shown unfolded on the page."""
_MANY = 30
"""Springs above which drawing takes longer than processes take to start."""


def write_codec_figures(
    folder: Path,
    data: CodecData,
    verdicts: Verdicts,
    insight: CodecAnalysis | None = None,
    axes: Sequence[str] = (),
    jobs: int | None = None,
) -> list[Path]:
    """Write the figures of a codec, each atomically; return their paths.

    ``codec.svg`` has the error norms, ``codec-x.svg`` and so on those along an axis,
    ``compliances.svg`` the compliances, ``indices.svg`` the indices, and ``codec.html`` all but
    the growth of the indices.

    Parameters
    ----------
    folder : Path
        An existing folder.
    data, verdicts : CodecData, Verdicts
        The arrays and what they say.
    insight : CodecAnalysis, optional
        From `codec.analyse`. Without it no compliances are drawn, since no picture
        could say which of them are findings; without its indices, none of them.
    axes : sequence of str
        Axes of which a printed figure is wanted beside that of the norm.
    jobs : int, optional
        Processes that draw; by default one, but all cores where there are many springs to draw.

    Raises
    ------
    CodecError
        If an axis is unknown, or a variant has nothing to draw, by its name.
    FileAccessError
        If a file cannot be written.
    """
    description = " ".join(verdicts.sentences)
    figures: dict[str, Callable[[], Figure]] = {"codec": partial(codec_chart, data, verdicts)}
    for axis in axes:
        figures[f"codec-{axis}"] = partial(codec_chart, data, verdicts, axis)
    found = insight or CodecAnalysis(())
    if found.seen:
        figures["compliances"] = partial(compliance_chart, data, found.seen)
    if found.indices:
        figures["indices"] = partial(index_chart, data, found.indices, found.correlations)
    many = bool(found.seen) and max(len(each.names) for each in data.springs) > _MANY
    processes = process_count(jobs or None, worthwhile=many)
    paths = {name: folder / f"{name}.svg" for name in figures}
    page = folder / PAGE
    # The largest figure first.
    tasks: list[Callable[[], object]] = [
        partial(write_figure, paths[name], draw, f"{headline(data)} ({name})", description)
        for name, draw in reversed(figures.items())
    ]
    tasks.append(partial(write_codec_page, page, data, verdicts, found.seen, found.correlations))
    deque(map_in_processes(_call, tasks, process_count(processes, len(tasks))), maxlen=0)
    return [*paths.values(), page]


def _call(task: Callable[[], object]) -> None:
    task()


def write_codec_page(
    path: Path,
    data: CodecData,
    verdicts: Verdicts,
    seen: Sequence[SpringObservability] = (),
    correlations: Sequence[Correlation] = (),
) -> Path:
    """Write the interactive page of a codec, atomically; return its path.

    Parameters
    ----------
    path : Path
        An HTML file.
    data, verdicts : CodecData, Verdicts
        The arrays and what they say.
    seen : sequence of SpringObservability, optional
        Springs that each variant determines; without it the page shows no compliances, since it
        could not mark the undetermined ones.
    correlations : sequence of Correlation, optional
        Correlations of all variants; without them the page has no table of indices.

    Raises
    ------
    CodecError
        If a variant has nothing to draw, by its name.
    FileAccessError
        If the page cannot be written.
    """
    names = [each.name for each in data.variants]
    if correlations:
        check_indices(names, [each.variant for each in correlations])
    charts = {"errors": error_views(data, verdicts)}
    if seen:
        charts["compliances"] = compliance_views(data, seen)
    variants = [
        {"name": variant.name, "colour": variant.colour, "fill": variant.fill}
        for variant in variant_styles(names)
    ]
    page = render(
        "codec.html",
        title=f"Codec: {data.robot or 'robot'}",
        styles=("page.css", "codec.css"),
        scripts=("codec.js",),
        interactive=True,
        data={"variants": variants, "charts": charts},
        provenance=data.provenance,
        figures=split_facts(data),
        verdicts=tuple(_verdicts(verdicts)),
        findings=group_alike(data.findings),
        how=how_to_read(data),
        last=data.n_train[-1],
        compliances=bool(seen),
        indices=_index_table(names, correlations) if correlations else None,
        errors=error_table(codec_summary(data, verdicts).variants),
        footer=f"Made by elastocal {data.versions.get('elastocal', '')}".strip() + ".",
    )
    write_text(path, page)
    return Path(path)


def _verdicts(found: Verdicts) -> Iterator[Block]:
    """Yield the springs, the verdicts on variants, and those on pairs, folded if they are many."""
    first = len(found.saturation)
    pairs = Bullets(found.sentences[first:], "verdicts")
    many = len(found.pairs) > _MOST_PAIRS
    yield Bullets(found.springs, "verdicts")
    yield Bullets(found.sentences[:first], "verdicts")
    yield Details(f"{len(found.pairs)} pairs of variants", (pairs,)) if many else pairs


def _index_table(names: Sequence[str], correlations: Sequence[Correlation]) -> Table:
    """Return the rank correlations of each kind with the mean error, a row for each index."""
    of = {(e.variant, e.index, e.kind): e for e in correlations if e.error == "mean"}
    rows = tuple(
        (name, INDEX_NAMES[index].title, *(_correlation(of[name, index, k]) for k in KIND_TITLES))
        for name in names
        for index in INDICES
    )
    heads = ("Variant", "Index", *KIND_TITLES.values())
    return Table("Rank correlations with the accuracy", heads, rows, texts=2)


def _correlation(found: Correlation) -> str:
    if found.correlation is None:
        return "index never varies"
    if found.low is None:
        return f"{found.correlation:+.2f} (no interval)"
    return f"{found.correlation:+.2f} ({found.low:+.2f} to {found.high:+.2f})"
