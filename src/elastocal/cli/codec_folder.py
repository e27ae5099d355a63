"""The files of a codec's folder."""

from pathlib import Path

from elastocal.codec import CodecData, Verdicts, verdict_record, write_codec, write_verdicts


def write_codec_folder(folder: Path, data: CodecData, verdicts: Verdicts) -> list[str]:
    """Write everything that a codec leaves behind; return the names of the files.

    Parameters
    ----------
    folder : Path
        An existing folder.
    data : CodecData
        The arrays.
    verdicts : Verdicts
        What they say.

    Raises
    ------
    FileAccessError
        If a file cannot be written.
    """
    paths = [write_codec(folder, data), write_verdicts(folder, verdict_record(data, verdicts))]
    return [path.name for path in paths]
