"""Show the tool on a force sensor as blocks for every shell: what is known, and how well."""

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.blocks import Block, Facts, Row, Table
from elastocal.compensation.conditioning.tool import ToolResult
from elastocal.compensation.conditioning.tool_choice import ToolRung
from elastocal.compensation.conditioning.tool_fit import TOOL_UNKNOWNS
from elastocal.units import SHOWN
from elastocal.wording import phrase, phrases, plus_minus

_UNITS = {"mass": "kg", "sensor": "deg", "force": "N", "centre": "mm", "moment": "N·m"}
"""Units by the first word of an unknown."""
_AXES = ("fx", "fy", "fz", "mx", "my", "mz")
_DETERMINED = 0.75
"""Share of an entry's prior variance that is gone where the postures halve its deviation."""


def show_tool(found: ToolResult) -> Iterator[Block]:
    """Yield the blocks of a tool.

    Parameters
    ----------
    found : ToolResult
        The tool.
    """
    yield _unknowns(found)
    if found.ladder:
        yield _ladder(found.ladder)
    yield Facts(tuple(_facts(found)))


def _unknowns(found: ToolResult) -> Table:
    """Return the unknowns with their intervals."""
    rotation = Rotation.from_matrix(found.R_flange_sensor).as_rotvec()
    values = [found.mass, *rotation, *found.force_bias, *found.centre, *found.moment_bias]
    rows: list[Row] = []
    for name, value in zip(TOOL_UNKNOWNS, values, strict=True):
        unit = _UNITS[name.split()[0]]
        scale, width = SHOWN.get(unit, 1.0), found.half_width[name]
        if width is None:
            rows.append((name, phrase("not determined"), "", ""))
        elif name.startswith("sensor") and found.rotation_known:
            rows.append((name, f"{scale * value:.4g}", phrase("as mounted"), unit))
        else:
            rows.append((name, *plus_minus(scale * value, scale * width), unit))
    caption = phrase("Tool and sensor from {postures} static postures", postures=found.postures)
    return Table(caption, phrases("Unknown", "Value", "± (95 %)", "Unit"), tuple(rows))


def _ladder(ladder: Sequence[ToolRung]) -> Table:
    """Return the models that were tried."""
    return Table(
        phrase("Models at the same unseen postures: what they leave"),
        (*phrases("Free", "Force, N", "Moment, N·m"), ""),
        tuple(
            (
                each.free,
                f"{each.force:.3g}",
                f"{each.moment:.3g}",
                phrase("taken") if each.chosen else "",
            )
            for each in ladder
        ),
    )


def _facts(found: ToolResult) -> Iterator[tuple[str, str]]:
    force, moment = (
        phrase("not known") if each is None else f"{each:.3g}"
        for each in (found.force_scatter, found.moment_scatter)
    )
    yield "scatter of a component", f"{force} N, {moment} N·m"
    if found.drift is not None:
        parts = (", ".join(f"{x:.3g}" for x in found.drift[k : k + 3]) for k in (0, 3))
        yield "drift from first to last posture", "{} N; {} N·m".format(*parts)
    if found.matrix_determined is not None:
        yield "sensor matrix", _matrix(found)
    yield from (("set aside", each.text) for each in found.set_aside)
    yield from (("note", text) for text in found.notes)
    if found.undetermined:
        yield (
            "not determined",
            phrase(
                "{names}. Take more postures that turn the sensor about two axes, 30 deg apart and"
                " more.",
                names=", ".join(found.undetermined),
            ),
        )


def _matrix(found: ToolResult) -> str:
    """Return the details of the sensor's matrix, and its effect."""
    shares = np.array(found.matrix_determined)
    known = [
        f"{_AXES[i]}<-{_AXES[k]}" for i in range(6) for k in range(6) if shares[i, k] > _DETERMINED
    ]
    use = (
        phrase("It takes the tool's weight only.")
        if found.matrix is None
        else phrase("It corrects readings.")
    )
    return phrase(
        "{rank} of 36 directions determined, the others stay at the identity; entries that are:"
        " {known}. {use}",
        rank=found.matrix_rank,
        known=", ".join(known) or phrase("none alone"),
        use=use,
    )
