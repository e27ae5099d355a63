"""Show a study as blocks for every shell: what each condition reaches, and the advice."""

from collections.abc import Iterator

from elastocal.blocks import Block, Paragraph, Row, Table
from elastocal.codec.study.conditions import value_text
from elastocal.codec.study.summary import ConditionSummary, Share, StudySummary, micrometres
from elastocal.wording import phrase, phrases

_MOST_CONDITIONS = 40


def show_study(summary: StudySummary) -> Iterator[Block]:
    """Yield the arms of a study, a row for each of the first conditions, and the advice.

    Parameters
    ----------
    summary : StudySummary
        Its figures.
    """
    yield Paragraph(f"{summary.cell}: {summary.sentence}")
    factors = summary.varied or ("poses",)
    heads = phrases("Mean", "95 %", "Largest", "95 %")
    caption = phrase(
        "Mean and largest error at unseen poses in µm: median over the arms, and what 95 % of them"
        " stay below"
    )
    if summary.target is not None:
        heads += phrases("Mean good", "Largest good")
        caption = phrase(
            "{errors}; good: arms within the target, with a 95 % interval", errors=caption
        )
    conditions = summary.conditions
    yield Table(
        caption,
        (*(name.replace("_", " ").capitalize() for name in factors), *heads),
        tuple(_row(each, factors) for each in conditions[:_MOST_CONDITIONS]),
        texts=len(factors),
    )
    if len(conditions) > _MOST_CONDITIONS:
        left = len(conditions) - _MOST_CONDITIONS
        yield Paragraph(phrase("{left} more conditions in study.json", left=left))
    if summary.advice:
        yield Paragraph(summary.advice)


def _row(found: ConditionSummary, factors: tuple[str, ...]) -> Row:
    errors = (
        micrometres(value)
        for each in (found.error_mean, found.error_max)
        for value in (each.median, each.q95)
    )
    shares = (_share(each) for each in (found.mean_reaches, found.max_reaches) if each is not None)
    return (*(value_text(found.factors.value(key)) for key in factors), *errors, *shares)


def _share(share: Share) -> str:
    return f"{share.share:.0%} [{100.0 * share.low:.0f}, {100.0 * share.high:.0f}]"
