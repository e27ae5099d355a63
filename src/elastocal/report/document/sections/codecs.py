"""Codecs: were there enough poses (paper Fig. 7, 9 and 10)."""

from collections.abc import Iterator
from functools import partial

from elastocal import blocks
from elastocal.codec import (
    Saturation,
    Variant,
    comparison_sentences,
    enough_sentence,
    saturation_table,
    split_facts,
)
from elastocal.report.document.section import Section
from elastocal.report.plots import ErrorCurve, error_curves, pose_count_figure
from elastocal.verdict import Evidence
from elastocal.wording import Phrase, counted, phrase


def _body(evidence: Evidence) -> Iterator[blocks.Block]:
    if not evidence.codecs:
        yield blocks.Paragraph(
            phrase("There is no codec, so it is not known whether there were enough poses.")
        )
        return
    yield split_facts(evidence.codecs[0].data)
    curves = _curves(evidence)
    if curves:
        yield blocks.Picture(
            partial(pose_count_figure, curves, evidence.limits.tolerance),
            _alt(curves),
            phrase(
                "Median over the splits of the mean error at verification poses; the band holds"
                " the middle half of the splits. Diamonds: more poses no longer help from there on."
            ),
        )
    else:
        yield blocks.Paragraph(phrase("No variant has an error that could be drawn."))
    yield _saturation(evidence)
    if best := evidence.saturation:
        yield blocks.Paragraph(enough_sentence(best))
    lines = dict.fromkeys(
        line for each in evidence.codecs for line in comparison_sentences(each.data, each.verdicts)
    )
    yield blocks.Bullets(tuple(lines))


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
        "Error at verification poses over the number of training poses, of {variants}",
        variants=counted(len(curves), "variant"),
    )


def _saturation(evidence: Evidence) -> blocks.Block:
    """Return a row for each variant, whichever comparisons it is in."""
    found: dict[tuple[str, ...], tuple[Variant, Saturation]] = {}
    for codec in evidence.codecs:
        for each in zip(codec.data.variants, codec.verdicts.saturation, strict=True):
            found.setdefault(_key(each[0]), each)
    return saturation_table(found.values())


CODECS = Section("codecs", phrase("Number of poses"), phrase("Were there enough poses?"), 60, _body)
