"""Codecs: were there enough poses (paper Fig. 7, 9 and 10)."""

from collections import Counter
from collections.abc import Iterator
from functools import partial
from pathlib import PurePath

from elastocal import blocks
from elastocal.codec import PairedDifference, Saturation, Variant
from elastocal.report.document.section import Section
from elastocal.report.plots import ErrorCurve, error_curves, pose_count_figure
from elastocal.verdict import CodecEvidence, Evidence
from elastocal.wording import Phrase, counted, mm, phrase, phrases, sentences


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
                "Median over the splits of the mean error at held-out poses; the band holds the"
                " middle half of the splits. Diamonds: more poses no longer help from there on."
            ),
        )
    else:
        yield blocks.Paragraph(phrase("No variant has an error that could be drawn."))
    yield _saturation(evidence)
    if best := evidence.saturation:
        yield blocks.Paragraph(_in_a_sentence(best))
    lines = dict.fromkeys(line for codec in evidence.codecs for line in _words(codec))
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
        "Error at held-out poses over the number of training poses, of {variants}",
        variants=counted(len(curves), "variant"),
    )


def _saturation(evidence: Evidence) -> blocks.Block:
    rows: dict[tuple[str, ...], blocks.Row] = {}
    for codec in evidence.codecs:
        pairs = zip(codec.data.variants, codec.verdicts.saturation, strict=True)
        for variant, found in pairs:
            rows.setdefault(_key(variant), _row(variant, found))
    heads = phrases("Search", "Springs", "Load cases", "Enough from", "95 % interval",
                    "Error there", "Error with the most", "Certain?")  # fmt: skip
    caption = phrase("Number of poses to fit from which on more do not lower the error")
    return blocks.Table(caption, heads, tuple(rows.values()), texts=3)


def _in_a_sentence(best: Saturation) -> Phrase:
    """Return what the row that counts for the verdict comes to."""
    if not best.explains or best.low is None or best.high is None:
        return phrase("How many poses are enough is not proved.")
    values = {"enough": counted(best.n_train, "pose"), "low": best.low, "high": best.high}
    if best.settled:
        return phrase("Enough for the verdict: {enough} (95 % interval {low} to {high}).", **values)
    return phrase(
        "Best estimate for the verdict: {enough}, but it could be anything from {low} to {high}:"
        " not proved.",
        **values,
    )


def _row(variant: Variant, found: Saturation) -> blocks.Row:
    return (
        variant.search,
        PurePath(variant.springs).name,
        variant.load_cases,
        _enough(found),
        phrase("not known")
        if found.low is None
        else phrase("{low} to {high}", low=found.low, high=found.high),
        mm(found.error),
        mm(found.last_error),
        phrase("yes") if found.settled else phrase("not sure"),
    )


def _enough(found: Saturation) -> str:
    if not found.explains:
        return phrase("never")
    no_trend = found.n_train == 1 and not found.settled
    return phrase("no trend found") if no_trend else str(found.n_train)


def _words(codec: CodecEvidence) -> Iterator[Phrase]:
    """Yield which variant is better, and which springs were chosen where the readings chose."""
    largest = max((each.last_error for each in codec.verdicts.saturation), default=0.0)
    for pair in codec.verdicts.pairs:
        yield _pair(pair, _MOST_APART * largest)
    data = codec.data
    rows = zip(data.variants, data.layouts, data.split_layouts, strict=True)
    for variant, layout, splits in rows:
        if variant.springs == layout:
            continue
        chosen = Counter(each[-1] for each in splits).most_common()
        yield phrase(
            "Springs {springs}, search {search}, loads {loads}: the springs are chosen anew in each"
            " split. With the most poses to fit these were chosen: {chosen}; all readings together"
            " choose {layout}.",
            springs=variant.springs,
            search=variant.search,
            loads=variant.load_cases,
            chosen=sentences(
                [
                    phrase("{springs} in {splits}", springs=name, splits=counted(many, "split"))
                    for name, many in chosen
                ],
                ", ",
            ),
            layout=layout,
        )


def _pair(pair: PairedDifference, most: float) -> Phrase:
    judged = pair.judged
    smaller, larger = (pair.a, pair.b) if judged.difference < 0.0 else (pair.b, pair.a)
    named = {"a": smaller, "b": larger, "poses": counted(judged.n_train, "pose")}
    size = mm(abs(judged.difference))
    if judged.low is None or judged.high is None:
        return phrase(
            "{a} against {b}, fitted to {poses}: the error is smaller by {difference}; how sure"
            " that is, is not known.",
            difference=size,
            **named,
        )
    low, high = judged.low, judged.high
    if pair.better is None and high - low > most:
        return phrase(
            "{a} against {b}, fitted to {poses}: they cannot be compared, some of these fits break"
            " down.",
            **named,
        )
    if judged.difference < 0.0:
        low, high = -high, -low
    found = phrase("{value} ({low} to {high})", value=size, low=mm(low), high=mm(high))
    return (
        phrase(
            "{a} against {b}, fitted to {poses}: no difference is shown; {a}'s error is smaller by"
            " {difference}.",
            difference=found,
            **named,
        )
        if pair.better is None
        else phrase(
            "{a} is better than {b}, fitted to {poses}: its error is smaller by {difference}.",
            difference=found,
            **named,
        )
    )


_MOST_APART = 10.0
"""Width of an interval by the largest error that is left, from which on some fits broke down."""

CODECS = Section("codecs", phrase("Number of poses"), phrase("Were there enough poses?"), 60, _body)
