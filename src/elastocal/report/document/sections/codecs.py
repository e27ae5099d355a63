"""Codecs: were there enough poses (paper Fig. 7, 9 and 10)."""

from collections.abc import Iterator
from functools import partial

from elastocal.errors import CodecError
from elastocal.report.codec_chart import codec_chart, headline, how_to_read
from elastocal.report.document.markup import facts, listed, paragraph, table
from elastocal.report.document.parts import Codec, Parts
from elastocal.report.document.pictures import picture
from elastocal.report.document.section import Content, Finding, Section
from elastocal.report.document.words import counted, mm


def body(parts: Parts) -> Content:
    """Return the section."""
    if parts.codec is None:
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
    data, verdicts = parts.codec.data, parts.codec.verdicts
    sets, size = data.verification.shape
    html = facts(
        [
            ("Poses", len(data.contact)),
            ("Splits", sets),
            ("Held-out poses in each", size),
            ("Training poses", f"1 to {data.n_train[-1]}"),
        ]
    )
    html += listed(_micro(each) for each in verdicts.sentences)
    try:
        html += picture(
            partial(codec_chart, data, verdicts),
            f"{headline(data)}: box plots of mean and maximum error at held-out poses over the"
            f" number of training poses. {_micro(' '.join(verdicts.sentences))}",
            f"After the paper's Fig. 7, 9 and 10. {how_to_read(data)}",
        )
    except CodecError as error:
        html += paragraph(f"No chart: {error}.")
    return Content(html + _table(parts.codec), findings=tuple(_findings(parts.codec)))


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


def _findings(codec: Codec) -> Iterator[Finding]:
    best = min(codec.verdicts.saturation, key=lambda each: each.last_error)
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
