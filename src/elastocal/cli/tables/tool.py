"""What ``elastocal tool`` shows."""

from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.spatial.transform import Rotation

from elastocal.compensation.conditioning import TOOL_UNKNOWNS, ToolResult

_SHOWN = {"mass": ("kg", 1.0), "sensor": ("deg", 180.0 / np.pi), "force": ("N", 1.0)}
_SHOWN |= {"centre": ("mm", 1e3), "moment": ("N*m", 1.0)}


def show_tool(console: Console, record: ToolResult, out: Path) -> None:
    """Print the unknowns with their intervals."""
    rotation = Rotation.from_matrix(record.R_flange_sensor).as_rotvec()
    values = [record.mass, *rotation, *record.force_bias, *record.centre, *record.moment_bias]
    table = Table("", "value", "± (95 %)", "", title=f"{record.postures} static postures")
    for name, value in zip(TOOL_UNKNOWNS, values, strict=True):
        unit, scale = _SHOWN[name.split()[0]]
        width = record.half_width[name]
        if width is None:
            table.add_row(name, "not determined", "", "")
        else:
            table.add_row(name, f"{scale * value:.4g}", f"{scale * width:.2g}", unit)
    console.print(table)
    if record.undetermined:
        console.print(
            f"not determined: {', '.join(record.undetermined)}. Take more postures that turn the"
            " sensor about two axes, 30 deg apart and more."
        )
    console.print(f"written to {out}")
