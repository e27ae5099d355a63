"""Codecs: were there enough poses (paper Fig. 7, 9 and 10)."""

from collections.abc import Iterator
from functools import partial

from elastocal.codec import CodecData, Saturation
from elastocal.errors import CodecError
from elastocal.report.codec_chart import codec_chart, headline, how_to_read
from elastocal.report.document.leading import leading
from elastocal.report.document.markup import facts, heading, listed, paragraph, table
from elastocal.report.document.parts import Codec, Parts
from elastocal.report.document.pictures import picture
from elastocal.report.document.section import Content, Finding, Section
from elastocal.report.document.words import counted, mm

_FIGURES = {"search": "Fig. 7", "springs": "Fig. 9", "load_cases": "Fig. 10"}
"""Of the paper, by what the codec compares."""


def body(parts: Parts) -> Content:
    """Return the section."""
    if not parts.codecs:
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
    data = parts.codecs[0].data
    sets, size = data.verification.shape
    html = facts(
        [
            ("Poses", len(data.contact)),
            ("Splits", sets),
            ("Held-out poses in each", size),
            ("Training poses", f"1 to {data.n_train[-1]}"),
        ]
    )
    html += "".join(_codec(codec) for codec in parts.codecs)
    best = leading(parts)
    return Content(html, findings=() if best is None else tuple(_findings(best)))


def _codec(codec: Codec) -> str:
    data, verdicts = codec.data, codec.verdicts
    names = [each.name for each in data.variants]
    title = " against ".join(names) if len(names) > 1 else f"Variant {names[0]}"
    html = heading(title) + listed(_micro(each) for each in verdicts.sentences)
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


def _like(data: CodecData) -> str:
    """Return the figure of the paper that compares the same."""
    for key, figure in _FIGURES.items():
        if len({getattr(each, key) for each in data.variants}) > 1:
            return figure
    return "codecs (Fig. 7, 9 and 10)"


def _micro(sentence: str) -> str:
    """Return a sentence with the sign that terminals may lack."""
    return sentence.replace(" um", " µm")


def _table(codec: Codec) -> str:
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
    if best.n_train == best.last:
        yield Finding(
            f"the codec has not saturated: the error of {best.variant} still falls at"
            f" {counted(best.last, 'training pose')}",
            advice="Measure more poses: the error still falls with every one.",
        )
    elif not best.settled:
        yield Finding(
            f"the codec does not show that {best.variant} has saturated: its interval reaches"
            f" {counted(best.last, 'training pose')}",
            advice="Measure some more poses to see that the error no longer falls.",
        )
    else:
        yield Finding(
            f"the error no longer fell from {counted(best.n_train, 'training pose')} on"
            f" ({best.variant}, 95 % interval {best.low} to {best.high}): more would not help",
            holds_back=False,
        )


SECTION = Section("codecs", "Number of poses: codecs", body)
