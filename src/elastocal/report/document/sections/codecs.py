"""Codecs: were there enough poses (paper Fig. 7, 9 and 10)."""

from collections.abc import Iterator
from functools import partial

from elastocal.codec import CodecData, Saturation
from elastocal.errors import CodecError
from elastocal.report.document.markup import facts, heading, listed, paragraph, table
from elastocal.report.document.pictures import picture
from elastocal.report.document.section import Content, Finding, Section
from elastocal.report.plots import (
    codec_chart,
    headline,
    how_to_read,
)
from elastocal.verdict.evidence import CodecEvidence, Evidence
from elastocal.verdict.judgement import leading
from elastocal.wording import counted, mm

_FIGURES = {
    "search": ("Search", "Fig. 7"),
    "springs": ("Springs", "Fig. 9"),
    "load_cases": ("Load cases", "Fig. 10"),
}
"""What a codec may compare: in words, and the figure of the paper that does; in its order."""


def body(evidence: Evidence) -> Content:
    """Return the section."""
    if not evidence.codecs:
        return Content(
            paragraph("There is no codec, so it is not known whether there were enough poses."),
            findings=(
                Finding(
                    "whether there were enough poses was not verified (no codec)",
                    advice="Make a codec with `elastocal codec`: it tells whether more poses would"
                    " help.",
                ),
            ),
        )
    data = evidence.codecs[0].data
    sets, size = data.verification.shape
    html = facts(
        [
            ("Poses", len(data.contact)),
            ("Splits", sets),
            ("Held-out poses in each", size),
            ("Training poses", f"1 to {data.n_train[-1]}"),
        ]
    )
    html += "".join(_codec(codec) for codec in sorted(evidence.codecs, key=_order))
    best = leading(evidence)
    return Content(html, findings=() if best is None else tuple(_findings(best)))


def _codec(codec: CodecEvidence) -> str:
    data, verdicts = codec.data, codec.verdicts
    html = heading(_title(data)) + listed(_micro(each) for each in verdicts.sentences)
    try:
        html += picture(
            partial(codec_chart, data, verdicts),
            f"{headline(data)}: box plots of mean and maximum error at held-out poses over the"
            f" number of training poses. {_micro(' '.join(verdicts.sentences))}",
            f"After the paper's {_like(data)}. {how_to_read(data)}",
            ".png",
        )
    except CodecError as error:
        html += paragraph(f"No chart: {error}.")
    return html + _table(codec)


def _title(data: CodecData) -> str:
    names = " against ".join(each.name for each in data.variants)
    key = _compared(data)
    return f"{_FIGURES[key][0]}: {names}" if key else names


def _like(data: CodecData) -> str:
    """Return the figure of the paper that compares the same."""
    key = _compared(data)
    return _FIGURES[key][1] if key else "codecs (Fig. 7, 9 and 10)"


def _compared(data: CodecData) -> str | None:
    """Return what the variants differ in, as far as the paper compares it."""
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


def _table(codec: CodecEvidence) -> str:
    rows = [
        (
            each.variant,
            str(each.n_train),
            "not known" if each.low is None else f"{each.low} to {each.high}",
            mm(each.error),
            mm(each.last_error),
            "yes" if each.settled else "not sure",
        )
        for each in codec.verdicts.saturation
    ]
    heads = ("Variant", "Saturated from", "95 % interval", "Error there", "Error with all",
             "Settled?")  # fmt: skip
    return table("Saturation: training poses from which on more do not help", heads, rows)


def _findings(best: Saturation) -> Iterator[Finding]:
    last = counted(best.last, "training pose")
    if best.n_train == best.last:
        yield Finding(
            f"the codec has not saturated: the error still falls at {last}",
            advice="Measure more poses: the error still falls with every one.",
        )
    elif not best.settled:
        yield Finding(
            f"the codec does not show that the error has saturated: its interval reaches {last}",
            advice="Measure some more poses to see that the error no longer falls.",
        )
    else:
        yield Finding(
            f"the error no longer fell from {counted(best.n_train, 'training pose')} on (95 %"
            f" interval {best.low} to {best.high}), so there were enough poses",
            holds_back=False,
        )


SECTION = Section("codecs", "Number of poses: codecs", body)
