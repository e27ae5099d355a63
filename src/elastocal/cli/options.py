"""Options that several commands share, with their help."""

from pathlib import Path
from typing import Annotated

import typer

RobotName = Annotated[
    str | None, typer.Option(help="URDF file or catalogue name; default: the dataset's own.")
]
TcpLink = Annotated[
    str | None, typer.Option(help="Link at the tool centre point; default: the dataset's.")
]
ToolFrame = Annotated[
    str | None, typer.Option(help="Tcp behind that link: 'x, y, z, a, b, c' with units (Z-Y'-X'').")
]
Marker = Annotated[
    str | None,
    typer.Option(help="Marker in the tcp frame: 'x, y, z' with units; default: the dataset's."),
]
Exclude = Annotated[
    list[str] | None, typer.Option(help="Leave out POSE or POSE:LOAD_CASE; repeatable.")
]
CompensatorFile = Annotated[Path | None, typer.Option(help="Settings of the compensator (.yaml).")]
Figures = Annotated[bool, typer.Option("--json", help="Print the figures as one JSON object.")]
KeyFigures = Annotated[
    bool, typer.Option("--json", help="Print the key figures as one JSON object.")
]
Written = Annotated[bool, typer.Option("--json", help="Print what was written as one JSON object.")]
