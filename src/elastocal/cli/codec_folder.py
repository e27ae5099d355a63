"""The files of a codec's folder."""

from collections.abc import Sequence
from pathlib import Path

from elastocal.codec import (
    CodecAnalysis,
    CodecData,
    CodecSummary,
    Verdicts,
    write_codec,
    write_codec_summary,
    write_index_table,
)
from elastocal.report import write_codec_figures


def write_codec_folder(
    folder: Path,
    data: CodecData,
    verdicts: Verdicts,
    result: CodecSummary,
    insight: CodecAnalysis,
    axes: Sequence[str] = (),
) -> list[str]:
    """Write everything that a codec leaves behind; return the names of the files.

    Parameters
    ----------
    folder : Path
        An existing folder.
    data : CodecData
        The arrays.
    verdicts, result : Verdicts, CodecSummary
        What they say, and its file.
    insight : CodecAnalysis
        What the readings tell beyond; its indices are written if there are any.
    axes : sequence of str
        Axes of which a printed figure is wanted beside that of the norm.

    Raises
    ------
    FileAccessError
        If a file cannot be written.
    """
    paths = [write_codec(folder, data), write_codec_summary(folder, result)]
    if insight.indices:
        paths.append(write_index_table(folder, data, insight.indices))
    paths += write_codec_figures(folder, data, verdicts, insight, axes)
    return [path.name for path in paths]
