"""Codecs: were there enough poses (paper Fig. 7, 9 and 10)."""

from collections.abc import Iterator
from functools import partial

from elastocal.codec import CodecData
from elastocal.errors import CodecError
from elastocal.report.document import blocks
from elastocal.report.plots import codec_chart, headline, how_to_read
from elastocal.verdict import CodecEvidence, Evidence
from elastocal.wording import mm

_FIGURES = {
    "search": ("Search", "Fig. 7"),
    "springs": ("Springs", "Fig. 9"),
    "load_cases": ("Load cases", "Fig. 10"),
}
"""Comparisons of the paper, in its order: title and figure of each."""


def _body(evidence: Evidence) -> Iterator[blocks.Block]:
    if not evidence.codecs:
        text = "There is no codec, so it is not known whether there were enough poses."
        yield blocks.Paragraph(text)
        return
    data = evidence.codecs[0].data
    sets, size = data.verification.shape
    yield blocks.Facts(
        (
            ("Poses", len(data.contact)),
            ("Splits", sets),
            ("Held-out poses in each", size),
            ("Training poses", f"1 to {data.n_train[-1]}"),
        )
    )
    for codec in sorted(evidence.codecs, key=_order):
        yield from _codec(codec)


def _codec(codec: CodecEvidence) -> Iterator[blocks.Block]:
    data, verdicts = codec.data, codec.verdicts
    yield blocks.Heading(_title(data))
    yield blocks.Bullets(tuple(map(_micro, (*verdicts.springs, *verdicts.sentences))))
    try:
        yield blocks.picture(
            partial(codec_chart, data, verdicts),
            f"{headline(data)}: box plots of mean and maximum error at held-out poses over the"
            f" number of training poses. {_micro(' '.join(verdicts.sentences))}",
            f"After the paper's {_like(data)}. {how_to_read(data)}",
            ".png",
        )
    except CodecError as error:
        yield blocks.Paragraph(f"No chart: {error}.")
    yield _saturation(codec)


def _title(data: CodecData) -> str:
    names = " against ".join(each.name for each in data.variants)
    key = _compared(data)
    return f"{_FIGURES[key][0]}: {names}" if key else names


def _like(data: CodecData) -> str:
    """Return the figure of the paper that compares the same."""
    key = _compared(data)
    return _FIGURES[key][1] if key else "codecs (Fig. 7, 9 and 10)"


def _compared(data: CodecData) -> str | None:
    """Return the key in which the variants differ, as far as the paper compares it."""
    for key in _FIGURES:
        if len({getattr(each, key) for each in data.variants}) > 1:
            return key
    return None


def _order(codec: CodecEvidence) -> int:
    key = _compared(codec.data)
    return list(_FIGURES).index(key) if key else len(_FIGURES)


def _micro(sentence: str) -> str:
    """Return a sentence with the sign that terminals may lack."""
    return sentence.replace(" um", " µm")


def _saturation(codec: CodecEvidence) -> blocks.Block:
    rows = tuple(
        (
            each.variant,
            str(each.n_train) if each.explains else "never",
            "not known" if each.low is None else f"{each.low} to {each.high}",
            mm(each.error),
            mm(each.last_error),
            "yes" if each.settled else "not sure",
        )
        for each in codec.verdicts.saturation
    )
    heads = ("Variant", "Saturated from", "95 % interval", "Error there", "Error with all",
             "Settled?")  # fmt: skip
    return blocks.Table("Saturation: training poses from which on more do not help", heads, rows)


CODECS = blocks.Section("codecs", "Number of poses: codecs", 60, _body)
