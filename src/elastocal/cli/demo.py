"""``elastocal demo``: a calibration on a simulated cell, from readings to predictions."""

from pathlib import Path
from typing import Annotated

import typer


def demo(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("demo"),
    seed: Annotated[int, typer.Option(min=0, help="Seed of the simulated cell.")] = 0,
) -> None:
    """Calibrate a simulated KUKA KR 120 HA and predict deflections at poses it has not seen."""
    from elastocal.cli.demo_cell import run_demo
    from elastocal.cli.output import console

    run_demo(console(), out, seed)
