"""Codecs: were there enough poses (paper Fig. 7, 9 and 10)."""

from collections.abc import Iterator
from functools import partial
from pathlib import PurePath

from elastocal.codec import Saturation, Variant
from elastocal.report.document import blocks
from elastocal.report.plots import ErrorCurve, error_curves, pose_count_figure
from elastocal.verdict import CodecEvidence, Evidence
from elastocal.wording import Phrase, counted, mm, phrase, phrases


def _body(evidence: Evidence) -> Iterator[blocks.Block]:
    if not evidence.codecs:
        yield blocks.Paragraph(
            phrase("There is no codec, so it is not known whether there were enough poses.")
        )
        return
    data = evidence.codecs[0].data
    sets, size = data.verification.shape
    last = phrase("1 to {last}", last=int(data.n_train[-1]))
    yield blocks.Facts(
        (
            (phrase("Poses"), len(data.contact)),
            (phrase("Splits"), sets),
            (phrase("Held-out poses in each"), size),
            (phrase("Training poses"), last),
        )
    )
    curves = _curves(evidence)
    if curves:
        yield blocks.Picture(
            partial(pose_count_figure, curves, evidence.limits.tolerance),
            _alt(curves),
            phrase(
                "Median over {splits} of the mean error in mm at {poses}; the band holds the middle"
                " half of the splits. Diamonds: more poses no longer help from there on. All"
                " comparisons in one picture; the paper shows them apart (Fig. 7, 9 and 10).",
                splits=counted(sets, "split"),
                poses=counted(size, "held-out pose"),
            ),
        )
    else:
        yield blocks.Paragraph(phrase("No variant has an error that could be drawn."))
    yield _saturation(evidence)
    for codec in evidence.codecs:
        yield from _words(codec)


def _curves(evidence: Evidence) -> list[ErrorCurve]:
    """Return each variant once, whichever comparisons it is in."""
    found: dict[tuple[str, ...], ErrorCurve] = {}
    for codec in evidence.codecs:
        for curve in error_curves(codec.data, codec.verdicts.saturation):
            found.setdefault(_key(curve.variant), curve)
    return list(found.values())


def _key(variant: Variant) -> tuple[str, ...]:
    return variant.search, variant.springs, variant.load_cases, str(variant.solver)


def _alt(curves: list[ErrorCurve]) -> Phrase:
    return phrase(
        "Error at held-out poses over the number of training poses, of {variants}",
        variants=counted(len(curves), "variant"),
    )


def _saturation(evidence: Evidence) -> blocks.Block:
    rows: dict[tuple[str, ...], blocks.Row] = {}
    for codec in evidence.codecs:
        pairs = zip(codec.data.variants, codec.verdicts.saturation, strict=True)
        for variant, found in pairs:
            rows.setdefault(_key(variant), _row(variant, found))
    heads = phrases("Search", "Springs", "Load cases", "Saturated from", "95 % interval",
                    "Error there", "Error with all", "Settled?")  # fmt: skip
    caption = phrase("Saturation: training poses from which on more do not help")
    return blocks.Table(caption, heads, tuple(rows.values()), texts=3)


def _row(variant: Variant, found: Saturation) -> blocks.Row:
    return (
        variant.search,
        PurePath(variant.springs).name,
        variant.load_cases,
        str(found.n_train) if found.explains else phrase("never"),
        phrase("not known")
        if found.low is None
        else phrase("{low} to {high}", low=found.low, high=found.high),
        mm(found.error),
        mm(found.last_error),
        phrase("yes") if found.settled else phrase("not sure"),
    )


def _words(codec: CodecEvidence) -> Iterator[blocks.Block]:
    """Yield what the comparison found, in its own words."""
    lines = tuple(map(_micro, (*codec.verdicts.springs, *codec.verdicts.sentences)))
    names = ", ".join(each.name for each in codec.data.variants)
    yield blocks.Details(phrase("In words: {variants}", variants=names), (blocks.Bullets(lines),))


def _micro(sentence: str) -> str:
    """Return a sentence with the sign that terminals may lack."""
    return sentence.replace(" um", " µm")


CODECS = blocks.Section(
    "codecs", phrase("Number of poses"), phrase("Were there enough poses?"), 60, _body
)
