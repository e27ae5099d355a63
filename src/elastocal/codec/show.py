"""Show a codec as blocks for every shell: were there enough poses, and which variant is better."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from pathlib import PurePath

import numpy as np

from elastocal.blocks import Block, Facts, Paragraph, Row, Table
from elastocal.codec.data import CodecData
from elastocal.codec.pairs import PairedDifference
from elastocal.codec.saturation import Saturation
from elastocal.codec.variants import Variant
from elastocal.codec.verdicts import CodecSummary, Curve, Verdicts
from elastocal.units import in_unit
from elastocal.wording import Phrase, counted, mm, phrase, phrases, sentences

_MOST_SIZES = 12
"""Numbers of training poses that a table shows where it is to be read at a glance."""
_MOST_APART = 10.0
"""Width of an interval by the largest error that is left, from which on some fits broke down."""


def show_codec(found: CodecSummary) -> Iterator[Block]:
    """Yield the splits of a codec, the springs, some errors, and the verdicts in words.

    Parameters
    ----------
    found : CodecSummary
        Its figures.
    """
    yield Paragraph(f"{found.robot}: {found.settings.sentence}")
    yield from map(Paragraph, found.springs)
    yield error_table(found.variants, _MOST_SIZES)
    yield from map(Paragraph, found.sentences)


def split_facts(data: CodecData) -> Facts:
    """Return the facts about the splits of a codec."""
    sets, size = data.verification.shape
    last = phrase("1 to {last}", last=int(data.n_train[-1]))
    return Facts(
        (
            (phrase("Poses"), len(data.contact)),
            (phrase("Splits"), sets),
            (phrase("Held-out poses in each"), size),
            (phrase("Training poses"), last),
            (phrase("Verified under load cases"), ", ".join(data.load_cases)),
        )
    )


def error_table(curves: Mapping[str, Curve], most: int | None = None) -> Table:
    """Return the median errors at verification poses by number of training poses.

    Parameters
    ----------
    curves : mapping of str to Curve
        By the name of the variant.
    most : int, optional
        Rows at most, spread evenly; all by default.
    """
    sizes = next(iter(curves.values())).n_train
    shown = np.linspace(0, len(sizes) - 1, min(len(sizes), most or len(sizes)))
    return Table(
        phrase("Error norm at verification poses in µm, median over the splits: mean / largest"),
        (phrase("Training poses"), *curves),
        tuple(
            (
                sizes[k],
                *(
                    f"{_um(each.error_mean[k])} / {_um(each.error_max[k])}"
                    for each in curves.values()
                ),
            )
            for k in np.unique(shown.round().astype(int))
        ),
        texts=0,
    )


def _um(length: float) -> str:
    return f"{in_unit(length, 'µm'):.1f}"


def saturation_table(found: Iterable[tuple[Variant, Saturation]]) -> Table:
    """Return a table of the number of poses beyond which more do not help, a row a variant."""
    heads = phrases("Search", "Springs", "Load cases", "Enough from", "95 % interval",
                    "Error there", "Error with the most", "Certain?")  # fmt: skip
    caption = phrase("Number of poses to fit from which on more do not lower the error")
    rows = tuple(_saturation(variant, saturation) for variant, saturation in found)
    return Table(caption, heads, rows, texts=3)


def enough_sentence(best: Saturation) -> Phrase:
    """Return in words how many poses are enough, or that it is not proved."""
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


def _saturation(variant: Variant, found: Saturation) -> Row:
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


def comparison_sentences(data: CodecData, verdicts: Verdicts) -> Iterator[Phrase]:
    """Yield which variant is better, and which springs were chosen where the readings chose."""
    largest = max((each.last_error for each in verdicts.saturation), default=0.0)
    for pair in verdicts.pairs:
        yield _pair(pair, _MOST_APART * largest)
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
