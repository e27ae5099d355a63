"""``elastocal predict``: the deflection of each row of joints and force."""

from pathlib import Path
from typing import Annotated

import typer


def predict(
    model: Annotated[Path, typer.Argument(help="Model file from calibrate.")],
    rows: Annotated[Path, typer.Argument(help="CSV: joint columns, force_x[N] …, moment_x[N*m] …")],
    out: Annotated[Path, typer.Option(help="CSV to write.")],
    as_json: Annotated[
        bool, typer.Option("--json", help="Print a summary as one JSON object.")
    ] = False,
) -> None:
    """Predict the deflection of each row, with 95 % intervals of the fit and of a measurement."""
    import numpy as np

    from elastocal.cli.output import console, print_json, refuse_overwriting
    from elastocal.dataset import joint_dimensions, read_load_rows, write_load_rows
    from elastocal.identification import read_model

    refuse_overwriting(out, model, rows)
    calibrated = read_model(model)
    robot = calibrated.model.robot
    loads = read_load_rows(rows, joint_dimensions(robot.joint_names, robot.revolute))
    prediction = calibrated.predict(loads.joint_position, loads.force, loads.moment)
    known = bool(np.isfinite(calibrated.misfit))
    parts = [
        ("", prediction.deflection),
        ("_low", prediction.low),
        ("_high", prediction.high),
    ]
    if known:
        parts += [
            ("_measured_low", prediction.measured_low),
            ("_measured_high", prediction.measured_high),
        ]
    added = {
        f"deflection_{axis}{suffix}[m]": values[:, index]
        for suffix, values in parts
        for index, axis in enumerate("xyz")
    }
    write_load_rows(out, loads, added)
    norms = np.linalg.norm(prediction.deflection, axis=1)
    figures = {
        "rows": len(norms),
        "deflection": {"mean": norms.mean(), "max": norms.max()},
        "misfit": calibrated.misfit if known else None,
    }
    if as_json:
        print_json(figures)
    else:
        console().print(
            f"{len(norms)} rows: predicted deflection {1e3 * norms.mean():.3f} mm mean,"
            f" {1e3 * norms.max():.3f} mm max; written to {out}",
            markup=False,
            soft_wrap=True,
        )
        if not known:
            console().print(
                "Note: the model does not know its errors at left-out poses, so that there are no"
                " intervals of what would be measured; calibrate again to have them",
                soft_wrap=True,
            )
