"""Solids as Plotly traces, shaded here: the same light on every machine and in every posture."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go

from elastocal.arrays import FloatArray
from elastocal.report.solids import Solid

_DARK = 0.5
"""Brightness of a face that is turned away from the light."""
_UNLIT = {"ambient": 1.0, "diffuse": 0.0, "specular": 0.0, "fresnel": 0.0}


def solid_trace(
    solid: Solid, light: FloatArray, name: str, colours: Sequence[str], part: Any = 0
) -> Any:
    """Return a Plotly mesh of a solid.

    Parameters
    ----------
    solid : Solid
        In base.
    light : ndarray, shape (3,)
        Unit vector towards the light.
    name : str
        Of the trace.
    colours : sequence of str
        Of the parts, as ``#rrggbb``.
    part : int or ndarray of int, shape (face,)
        Which part each face belongs to.
    """
    x, y, z = single(solid.vertices)
    i, j, k = np.asarray(solid.faces, dtype=np.int32).T
    return go.Mesh3d(
        x=x, y=y, z=z, i=i, j=j, k=k, name=name, hoverinfo="skip", showscale=False,
        intensity=tones(solid, light, part, len(colours)), intensitymode="cell", cmin=0.0, cmax=1.0,
        colorscale=_scale(colours), lighting=_UNLIT,
    )  # fmt: skip


def tones(solid: Solid, light: FloatArray, part: Any, parts: int) -> Any:
    """Return where each face lies on the colour scale of `solid_trace`, shape (face,).

    Each part has its own stretch of the scale, from dark to light.
    """
    within = 0.01 + 0.98 * solid.brightness(light)
    return ((part + within) / parts).astype(np.float32)


def single(points: FloatArray) -> Any:
    """Return x, y, z in single precision, shape (3, point): good to a micrometre within 10 m."""
    return np.asarray(points, dtype=np.float32).T


def _scale(colours: Sequence[str]) -> list[tuple[float, str]]:
    stops = []
    for number, colour in enumerate(colours):
        stops.append((number / len(colours), _darker(colour)))
        stops.append(((number + 1) / len(colours), colour))
    return stops


def _darker(colour: str) -> str:
    parts = (int(colour[start : start + 2], 16) for start in (1, 3, 5))
    return "#" + "".join(f"{round(_DARK * part):02x}" for part in parts)
