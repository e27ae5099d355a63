"""All pictures of a codec: on paper, and one page to explore (paper Fig. 7, 9, 10)."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from matplotlib.figure import Figure

from elastocal.codec import CodecAnalysis, CodecData, Verdicts
from elastocal.report.codec_chart import codec_chart, headline
from elastocal.report.codec_page import write_codec_page
from elastocal.report.compliance_chart import compliance_chart
from elastocal.report.index_chart import index_chart
from elastocal.report.printed import write_kinds

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
        From `codec.insight.look_into`. Without it no compliances are drawn, since no picture
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
    told = " ".join(verdicts.sentences)
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
        paths += write_kinds(kinds, draw, f"{headline(data)} ({name})", told)
    page = write_codec_page(folder / PAGE, data, verdicts, found.seen, found.correlations)
    return [*paths, page]
