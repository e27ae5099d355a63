"""Show a plan as blocks for every shell."""

from collections.abc import Iterator

from elastocal import blocks
from elastocal.planning.plan_result import PlanResult
from elastocal.planning.production import ProductionRecord
from elastocal.units import quantity
from elastocal.wording import duration, in_words, mm, phrase, phrases, readable


def show_plan(plan: PlanResult) -> Iterator[blocks.Block]:
    """Yield the key figures of a plan, how its poses lie, what they promise, and the checks."""
    yield blocks.Facts(key_figures(plan))
    yield spreads(plan)
    if plan.production is not None:
        yield expected(plan, plan.production)
    yield _checks(plan)


def key_figures(plan: PlanResult) -> tuple[tuple[str, str], ...]:
    """Return the figures that are read first, as name and value with its unit."""
    search, pool = plan.search, plan.pool
    radius: str = readable(search.covering_radius, "m")
    if search.d_max is not None:
        asked = readable(search.d_max, "m")
        radius = phrase("{radius} (asked: {asked})", radius=radius, asked=asked)
    return (
        (phrase("Poses"), str(len(plan.poses))),
        (phrase("Covering radius"), radius),
        (phrase("Total time"), duration(plan.total_time)),
        (phrase("Travel between poses"), duration(plan.travel_time)),
        (
            phrase("Points with a posture"),
            phrase("{rank} of {all}", rank=pool.valid, all=pool.sampled),
        ),
        (phrase("Most frequent reason to refuse a point"), in_words(pool.bottleneck or "none")),
        *(_covered(plan.production) if plan.production is not None else ()),
    )


def _covered(production: ProductionRecord) -> tuple[tuple[str, str], ...]:
    found = production.expected_of(production.poses)
    label = (
        phrase("Error on production from noise alone")
        if production.floor is None
        else phrase("Expected error on production")
    )
    error = ((label, mm(found.error)),) if found is not None else ()
    return ((phrase("Production covered"), f"{production.coverage.covered:.0%}"), *error)


def spreads(plan: PlanResult) -> blocks.Table:
    """Return the distribution of the chosen poses in their pool, beside another technique's."""
    search, other = plan.search, plan.comparison
    rows = [(search.name, search.spread)] + ([(other.name, other.spread)] if other else [])
    return blocks.Table(
        phrase("How the poses lie in the pool"),
        phrases(
            "Technique",
            "Covering radius",
            "To the edge, mean",
            "To the next pose, mean",
            "Observability O1 (more is better)",
        ),
        tuple(
            (
                name if name == search.name else phrase("{name} (not used)", name=name),
                mm(spread.covering_radius, 1),
                phrase("no edge")
                if spread.boundary_distance is None
                else mm(spread.boundary_distance, 1),
                phrase("one pose")
                if spread.nearest_neighbour is None
                else mm(spread.nearest_neighbour, 1),
                f"{spread.o1:.4f}",
            )
            for name, spread in rows
        ),
    )


def expected(plan: PlanResult, production: ProductionRecord) -> blocks.Table:
    """Return the error to expect on production from some numbers of poses, and what they take."""
    sigma, is_known = mm(production.sigma), production.floor is not None
    caption = (
        phrase(
            "Error to expect on production, root mean square of the deviation, from readings that"
            " scatter by {sigma}",
            sigma=sigma,
        )
        if is_known
        else phrase(
            "Error to expect on production, root mean square of the deviation, from readings that"
            " scatter by {sigma}; the model's own error comes on top and is not known before a"
            " calibration",
            sigma=sigma,
        )
    )
    heads = (
        *phrases("Poses", "Error from noise"),
        *(phrases("With the model's own error") if is_known else ()),
        phrase("In the cell"),
    )
    rows = tuple(
        (
            phrase("{poses} (this plan)", poses=each.poses)
            if each.poses == production.poses
            else str(each.poses),
            mm(each.noise),
            *((mm(each.error),) if is_known else ()),
            f"{plan.time_of(each.poses) / 60.0:.0f} min",
        )
        for each in production.some_expected()
    )
    return blocks.Table(caption, heads, rows)


def _checks(plan: PlanResult) -> blocks.Table:
    """Return the refusals of each check, and how near the chosen poses come to its limit."""
    rows = []
    for check in plan.pool.checks:
        margins = {
            pose.id: pose.margins[check.name] for pose in plan.poses if check.name in pose.margins
        }
        worst = min(margins, key=lambda pose: margins[pose], default=None)
        most = check.name == plan.pool.bottleneck
        rows.append(
            (
                in_words(check.name),
                phrase("{points} (most)", points=check.refused) if most else str(check.refused),
                "" if worst is None else _margin(margins[worst], check.unit),
                "" if worst is None else str(worst),
            )
        )
    heads = phrases("Check", "Points refused", "Smallest margin of a pose", "At pose")
    return blocks.Table(phrase("Checks"), heads, tuple(rows))


def _margin(margin: float, unit: str | None) -> str:
    if unit in ("m", "rad"):
        return quantity(margin, "mm" if unit == "m" else "°", ".1f")
    return f"{margin:.3f}" if unit in (None, "1") else f"{margin:.1f} {unit}"
