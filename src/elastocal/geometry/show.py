"""Show a calibrated geometry as blocks for every shell.

How far off the arm was and is; is the model better than simpler ones; which errors are known.
"""

from collections.abc import Iterator, Sequence

from elastocal.blocks import Block, Facts, Row, Table
from elastocal.geometry.accuracy import GeometryAccuracy, PoseAccuracy
from elastocal.geometry.model import GeometryModel
from elastocal.wording import mm, phrase, phrases

_AXES = dict(
    zip(
        ("x", "y", "z", "norm"),
        phrases("x of the base", "y of the base", "z of the base", "distance"),
        strict=True,
    )
)
_SHOWN = {
    "m": (1e3, "mm", 3),
    "rad": (1e3, "mrad", 3),
    "rad/(N*m)": (1e6, "µrad/(N·m)", 3),
    "m/N": (1e6, "µm/N", 3),
    "1": (1e6, "ppm", 0),
}
"""Factor, unit and digits in which numbers are shown."""


def show_geometry(model: GeometryModel, accuracy: GeometryAccuracy) -> Iterator[Block]:
    """Yield the tables that a person asks of a calibrated geometry.

    Parameters
    ----------
    model : GeometryModel
        The geometry.
    accuracy : GeometryAccuracy
        Its errors at poses that were left out of the fit.
    """
    yield axis_table(accuracy)
    yield rung_table(model)
    if model.parameters:
        yield arm_error_table(model)
    if accuracy.poses:
        yield repeatability_facts(accuracy.poses)


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
    return Table(
        phrase("Models at the same left-out poses, mm"),
        (*phrases("Model", "Unknowns", "Mean", "95 % below", "Largest"), ""),
        tuple(
            (
                each.rung,
                each.unknowns,
                *(f"{1e3 * value:.3f}" for value in vars(each.held_out).values()),
                phrase("taken") if each.chosen else "",
            )
            for each in model.ladder
        ),
    )


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
