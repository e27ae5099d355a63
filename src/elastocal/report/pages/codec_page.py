"""One HTML file that shows a codec: verdicts, charts to explore, and their numbers in tables.

It holds all that it needs, the drawing library included, and asks the network for nothing: its
content security policy forbids it to.
"""

from collections.abc import Callable, Sequence
from functools import partial
from html import escape
from pathlib import Path
from string import Template

from matplotlib.figure import Figure
from plotly.offline import get_plotlyjs

from elastocal.codec import (
    INDICES,
    CodecAnalysis,
    CodecData,
    Correlation,
    SpringObservability,
    Verdicts,
)
from elastocal.files import write_text
from elastocal.report.pages.templating import POLICY, embedded, template
from elastocal.report.plots import (
    ERROR_PANELS,
    INDEX_NAMES,
    KIND_TITLES,
    check_indices,
    codec_chart,
    compliance_chart,
    compliance_views,
    error_boxes,
    error_views,
    headline,
    how_to_read,
    index_chart,
    variant_styles,
    write_kinds,
)

_MANY_PAIRS = 3
"""Pairs of variants from which on their verdicts fold."""


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
        What each variant tells apart; without it the page shows no compliances, since it could
        not say which of them are findings.
    correlations : sequence of Correlation, optional
        Of all variants; without them the page has no table of indices.

    Raises
    ------
    CodecError
        If a variant has nothing to draw, by its name.
    FileAccessError
        If the page cannot be written.
    """
    write_text(path, _page(data, verdicts, seen, correlations))
    return Path(path)


def _page(
    data: CodecData,
    verdicts: Verdicts,
    seen: Sequence[SpringObservability],
    correlations: Sequence[Correlation],
) -> str:
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
    return Template(template("codec.html")).substitute(
        policy=escape(POLICY),
        title=escape(f"Codec: {data.robot or 'robot'}"),
        subtitle=escape(data.provenance),
        css=template("plan.css") + template("codec.css"),
        figures="".join(
            f"<div><dt>{escape(name)}</dt><dd>{escape(value)}</dd></div>"
            for name, value in key_figures(data)
        ),
        verdicts=_verdicts(verdicts),
        findings=_findings(data),
        how=escape(how_to_read(data)),
        last=data.n_train[-1],
        compliances=_compliances(data) if seen else "",
        indices=_indices(names, correlations),
        columns="".join(f'<th scope="col" colspan="2">{escape(name)}</th>' for name in names),
        halves='<th scope="col">mean</th><th scope="col">maximum</th>' * len(names),
        rows=_rows(data),
        footer=escape(f"Made by elastocal {data.versions.get('elastocal', '')}".strip() + "."),
        data=embedded({"variants": variants, "charts": charts}),
        plotly=get_plotlyjs(),
        script=template("codec.js"),
    )


def key_figures(data: CodecData) -> list[tuple[str, str]]:
    """Return the figures at the head of the page, as name and value."""
    sets, size = data.verification.shape
    return [
        ("Poses", str(len(data.contact))),
        ("Splits", str(sets)),
        ("Held-out poses in each", str(size)),
        ("Training poses", f"1 to {data.n_train[-1]}"),
        ("Verified under load cases", ", ".join(data.load_cases)),
    ]


def _verdicts(verdicts: Verdicts) -> str:
    """Return the sentences; those on pairs fold where they are many."""
    first = len(verdicts.saturation)
    single, pairs = (
        "".join(f"<li>{escape(sentence)}</li>" for sentence in sentences)
        for sentences in (verdicts.sentences[:first], verdicts.sentences[first:])
    )
    shown = f'<ul class="verdicts">{single}</ul>'
    if len(verdicts.pairs) > _MANY_PAIRS:
        return (
            f"{shown}<details><summary>{len(verdicts.pairs)} pairs of variants</summary>"
            f'<ul class="verdicts">{pairs}</ul></details>'
        )
    return shown + (f'<ul class="verdicts">{pairs}</ul>' if pairs else "")


def _compliances(data: CodecData) -> str:
    return Template(template("codec_compliances.html")).substitute(last=data.n_train[-1])


def _findings(data: CodecData) -> str:
    if not data.findings:
        return ""
    items = "".join(f"<li>{escape(finding)}</li>" for finding in data.findings)
    return f'<section class="findings"><h2>Findings</h2><ul>{items}</ul></section>'


def _rows(data: CodecData) -> str:
    """Return the medians of the error norms, a row for each number of training poses."""
    columns = [
        dict(zip(boxes.n.tolist(), boxes.median.tolist(), strict=True))
        for pair in zip(*(error_boxes(data, which, "norm") for which in ERROR_PANELS), strict=True)
        for boxes in pair
    ]
    return "".join(
        f'<tr><th scope="row">{n}</th>'
        + "".join(
            f"<td>{column[n]:.4f}</td>" if n in column else "<td>none</td>" for column in columns
        )
        + "</tr>"
        for n in data.n_train.tolist()
    )


def _indices(names: Sequence[str], correlations: Sequence[Correlation]) -> str:
    """Return the table of rank correlations with the mean error, empty without any."""
    if not correlations:
        return ""
    heads = "".join(f'<th scope="col">{title}</th>' for title in KIND_TITLES.values())
    of = {(e.variant, e.index, e.kind): e for e in correlations if e.error == "mean"}
    rows = "".join(
        f'<tr><td>{escape(name)}</td><th scope="row">{INDEX_NAMES[index].title}</th>'
        + "".join(f"<td>{_correlation(of[name, index, kind])}</td>" for kind in KIND_TITLES)
        + "</tr>"
        for name in names
        for index in INDICES
    )
    return Template(template("codec_indices.html")).substitute(heads=heads, rows=rows)


def _correlation(found: Correlation) -> str:
    if found.correlation is None:
        return "index never varies"
    if found.low is None:
        return f"{found.correlation:+.2f} (no interval)"
    return f"{found.correlation:+.2f} ({found.low:+.2f} to {found.high:+.2f})"


KINDS = (".svg", ".png")
"""In which kinds every figure is written."""
PAGE = "codec.html"


def write_codec_figures(
    folder: Path,
    data: CodecData,
    verdicts: Verdicts,
    insight: CodecAnalysis | None = None,
    axes: Sequence[str] = (),
) -> list[Path]:
    """Write the figures of a codec, each atomically; return their paths.

    ``codec.svg`` has the error norms, ``codec-x.svg`` and so on those along an axis,
    ``compliances.svg`` the compliances, ``indices.svg`` the indices; all also as PNG; and
    ``codec.html`` all but the growth of the indices.

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
    paths: list[Path] = []
    for name, draw in figures.items():
        kinds = [folder / f"{name}{kind}" for kind in KINDS]
        paths += write_kinds(kinds, draw, f"{headline(data)} ({name})", description)
    page = write_codec_page(folder / PAGE, data, verdicts, found.seen, found.correlations)
    return [*paths, page]
