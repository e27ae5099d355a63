"""Show a calibrated geometry as blocks for every shell.

How far off the arm was and is; is the model better than simpler ones; which errors are known.
"""

from collections import Counter
from collections.abc import Iterator, Sequence

from elastocal.blocks import Block, Facts, Paragraph, Row, Table
from elastocal.findings import Finding
from elastocal.geometry.accuracy import GeometryAccuracy, PoseAccuracy
from elastocal.geometry.model import DistanceFigures, GeometryModel
from elastocal.geometry.position_plan import PositionPlan
from elastocal.wording import counted, duration, listed, mm, phrase, phrases, point

_AXES = dict(
    zip(
        ("x", "y", "z", "norm"),
        phrases("x of the base", "y of the base", "z of the base", "distance"),
        strict=True,
    )
)
_MOST_ROWS = 12
"""Rows with blunders that are named."""
_SHOWN = {
    "m": (1e3, "mm", 3),
    "rad": (1e3, "mrad", 3),
    "rad/(N*m)": (1e6, "µrad/(N·m)", 3),
    "m/N": (1e6, "µm/N", 3),
    "1": (1e6, "ppm", 0),
}
"""Factor, unit and digits in which numbers are shown."""


def show_geometry(
    model: GeometryModel,
    accuracy: GeometryAccuracy,
    test: DistanceFigures | None = None,
    test_findings: Sequence[Finding] = (),
) -> Iterator[Block]:
    """Yield the tables of a calibrated geometry.

    Parameters
    ----------
    model : GeometryModel
        The geometry.
    accuracy : GeometryAccuracy
        Its errors at left-out poses.
    test : DistanceFigures, optional
        Its errors at the positions of another table.
    test_findings : sequence of Finding
        Warnings about these positions.
    """
    yield axis_table(accuracy)
    yield rung_table(model)
    if model.parameters:
        yield arm_error_table(model)
    if model.functions:
        yield function_table(model)
    if accuracy.poses:
        yield repeatability_facts(accuracy.poses)
    facts = [("warning", str(each)) for each in (*model.findings, *test_findings)]
    if model.blunders:
        rows = listed(tuple(map(str, model.blunders)), _MOST_ROWS)
        facts.append(
            (phrase("left out as blunders"), phrase("rows {rows}, counted from 0", rows=rows))
        )
        if model.with_blunders is not None:
            facts.append((phrase("mean error with them"), mm(model.with_blunders.chosen.mean)))
    if model.T_tcp_built is not None:
        off = point(model.T_tcp_built[:3, 3].tolist(), digits=3)
        facts.append((phrase("tcp"), phrase("{off} mm from where it is described", off=off)))
    if test is not None:
        values = {name: mm(each) for name, each in vars(test).items()}
        text = phrase("{mean} mean, {p95} at 95 %, {max} at most", **values)
        facts.append((phrase("error at the positions of the other table"), text))
    facts.append((phrase("errors not told apart from others"), str(len(model.fixed))))
    yield Facts(tuple(facts))


def show_position_plan(plan: PositionPlan) -> Iterator[Block]:
    """Yield the poses to measure, and the expected accuracy."""
    seen = Counter(pose.station for pose in plan.poses)
    yield Paragraph(
        phrase(
            "{poses} in free space ({technique}) of {pool} that can be measured, for {errors}"
            " errors of the arm: {stations}; {time} on the way",
            poses=counted(len(plan.poses), "pose"),
            technique=plan.technique,
            pool=plan.pool,
            errors=plan.errors,
            stations=", ".join(
                phrase("{poses} by {station}", poses=counted(number, "pose"), station=name)
                for name, number in seen.items()
            ),
            time=duration(plan.travel_time),
        )
    )
    yield Table(
        phrase("Error of a predicted position"),
        phrases("Poses", "In standard deviations of a measured coordinate"),
        tuple((each.poses, f"{each.amplification:.2f}") for each in plan.expected),
    )
    if plan.functions:
        yield _shown_functions(plan)
    refused = ", ".join(f"{name} {number}" for name, number in plan.refused.items())
    yield Facts(
        (
            *(("warning", str(each)) for each in plan.findings),
            (
                "postures",
                phrase("{drawn} drawn; refused by {refused}", drawn=plan.drawn, refused=refused),
            ),
        )
    )


def _shown_functions(plan: PositionPlan) -> Table:
    """Return what the poses show of functions of the joints, a row a joint."""
    by_joint: dict[str, list[str]] = {}
    for each in plan.functions:
        more = phrase("more than {pool}", pool=plan.pool)
        cells = by_joint.setdefault(each.joint, [])
        cells += [f"{100 * each.unknown:.0f} %", more if each.poses is None else str(each.poses)]
    orders = dict.fromkeys(each.orders for each in plan.functions)
    heads = [phrase("Joint")]
    for order in orders:
        heads += [phrase("Unknown up to {order} a turn", order=order), phrase("Poses for a third")]
    return Table(
        phrase("Functions of the joints (gears, encoders): what these poses leave unknown"),
        tuple(heads),
        tuple((joint, *cells) for joint, cells in by_joint.items()),
    )


def axis_table(accuracy: GeometryAccuracy) -> Table:
    """Return the errors along each axis, before and after."""
    rows: list[Row] = []
    for each in accuracy.axes:
        for when, figures in (
            (phrase("before"), each.registration),
            (phrase("after"), each.chosen),
        ):
            bias = "" if each.axis == "norm" else f"{1e3 * figures.bias:+.3f}"
            values = (figures.mean, figures.rms, figures.p95, figures.max)
            rows.append((_AXES[each.axis], when, bias, *(f"{1e3 * v:.3f}" for v in values)))
    heads = (
        phrase("Along"),
        "",
        *phrases("Bias", "Mean size", "Root mean square", "95 % below", "Largest"),
    )
    return Table(phrase("Errors by axis in mm, of poses left out"), heads, tuple(rows), texts=2)


def rung_table(model: GeometryModel) -> Table:
    """Return the models that were tried, with their errors at the same left-out poses."""
    taken = {"" if model.chain is None else model.chain.rung: phrase("in URDF and table")}
    taken |= {each.rung: phrase("taken") for each in model.ladder if each.chosen}
    tried = any(each.regions is not None for each in model.ladder)
    heads = phrases("Model", "Unknowns", "Mean", "95 % below", "Largest")
    return Table(
        phrase("Models at the same left-out poses, mm"),
        (*heads, *(phrases("Mean, regions left out") if tried else ()), ""),
        tuple(
            (
                each.rung,
                each.unknowns,
                *(f"{1e3 * value:.3f}" for value in vars(each.held_out).values()),
                *(() if each.regions is None else (f"{1e3 * each.regions.mean:.3f}",)),
                taken.get(each.rung, ""),
            )
            for each in model.ladder
        ),
    )


def function_table(model: GeometryModel) -> Table:
    """Return the functions of the joints, a row a joint."""
    heads = (phrase("Joint"), "", *phrases("Largest, µrad", "Strongest order", "Its amplitude"))
    rows = tuple(
        (
            each.joint,
            phrase("known") if each.known else phrase("not known"),
            f"{1e6 * each.largest:.0f}",
            each.order,
            f"{1e6 * each.amplitude:.0f}",
        )
        for each in model.functions
    )
    return Table(phrase("Functions of the joints beyond twice a turn"), heads, rows, texts=2)


def arm_error_table(model: GeometryModel) -> Table:
    """Return the errors of the arm with their 95 % intervals."""
    rows: list[Row] = []
    for each in model.parameters:
        scale, unit, digits = _SHOWN.get(each.unit, (1.0, each.unit, 3))
        value, low, high = (
            f"{scale * number:+.{digits}f}" for number in (each.value, each.low, each.high)
        )
        known = phrase("known") if each.known else phrase("not known")
        interval = phrase("{low} to {high}", low=low, high=high)
        rows.append((each.name, known, value, unit, interval))
    heads = (phrase("Error"), "", *phrases("Value", "Unit", "95 % interval"))
    return Table(phrase("Errors of the arm"), heads, tuple(rows), texts=2)


def repeatability_facts(poses: Sequence[PoseAccuracy]) -> Facts:
    """Return accuracy (AP) and repeatability (RP) of repeated poses after ISO 9283.

    Parameters
    ----------
    poses : sequence of PoseAccuracy
        One at least.
    """
    before, after, repeated = (
        [getattr(each, name) for each in poses]
        for name in ("registration", "chosen", "repeatability")
    )
    return Facts(
        (
            (phrase("AP before, mean"), mm(sum(before) / len(poses))),
            (phrase("AP before, largest"), mm(max(before))),
            (phrase("AP after, mean"), mm(sum(after) / len(poses))),
            (phrase("AP after, largest"), mm(max(after))),
            (phrase("RP, mean"), mm(sum(repeated) / len(poses))),
            (phrase("RP, largest"), mm(max(repeated))),
        )
    )
