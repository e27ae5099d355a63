"""How bad the simulated cell is: the figures of the presets `kind`, `typical`, `harsh`.

One table gives the defaults of the section ``simulation`` and the page on the simulated cell. A
figure that is not in it is the same in all presets.
"""

from dataclasses import dataclass
from typing import Any, Literal, get_args

from pydantic import Field

from elastocal.results import brief_repr

Preset = Literal["kind", "typical", "harsh"]
"""Names of the presets: a well-kept small arm, what published arms show, and about twice that."""
PRESETS: tuple[Preset, ...] = get_args(Preset)

_Value = str | float | tuple[str | float, ...] | None


@brief_repr
@dataclass(frozen=True)
class PresetFigure:
    """One figure of the simulated truth in every preset."""

    key: str
    """Place in the section ``simulation``, such as ``gears.growth``."""
    effect: str
    """What it says."""
    kind: _Value
    """As a cell file has it: quantities with their unit."""
    typical: _Value
    harsh: _Value
    source: str
    """Where the magnitude comes from: "assumption" where nobody was found to say it, † where a data
    sheet is cited from memory."""

    def of(self, preset: Preset) -> _Value:
        """Return the figure of a preset."""
        values: dict[Preset, _Value] = {
            "kind": self.kind, "typical": self.typical, "harsh": self.harsh,
        }  # fmt: skip
        return values[preset]


PRESET_FIGURES = (
    PresetFigure(
        "gears.growth",
        "gears: 1 - K1/K3, stiffness missing at rest",
        0.2,
        0.3,
        0.4,
        "catalogues of strain-wave gears state K1, K2, K3 by zones of torque: K1/K3 about 0.55"
        " (Harmonic Drive CSG †); RV gears are straighter, 0.8 is an assumption",
    ),
    PresetFigure(
        "gears.lost_motion",
        "gears: lost motion of each joint, all in",
        None,
        ("0.005 deg", "0.005 deg", "0.006 deg", "0.008 deg", "0.009 deg", "0.01 deg"),
        ("0.01 deg", "0.01 deg", "0.012 deg", "0.016 deg", "0.018 deg", "0.02 deg"),
        "Nabtesco RV-E, RV-N catalogues †: at most 1 arc min new; 0.3' to 0.6' is half of it,"
        " smaller on the large gears; harsh: the limit, and a little worn at the wrist",
    ),
    PresetFigure(
        "gears.presliding",
        "gears: twist until the friction is at its full height",
        "60e-6 rad",
        "100e-6 rad",
        "150e-6 rad",
        "assumption: of the size of the lost motion, as in Ruderman, Hoffmann, Bertram 2009 †",
    ),
    PresetFigure(
        "gears.residual",
        "gears: friction strain left by a free move, over `presliding`",
        0.0,
        0.5,
        1.0,
        "assumption: a gear stops somewhere in its loop (He, Guo, Sun 2023 see the way of arrival"
        " in the position error)",
    ),
    PresetFigure(
        "bearings.ratio",
        "bearings: stiffness of the two tilts over that of the gear",
        (4.0, 6.0),
        (3.0, 7.0),
        (2.5, 8.0),
        "assumption: a housing is softer across its ribs; mean as in kind",
    ),
    PresetFigure(
        "bearings.turn",
        "bearings: tilt axes turned about the joint's",
        "0 deg",
        "30 deg",
        "45 deg",
        "assumption: principal axes of a casting are no axes of a drawing; 45 deg is farthest",
    ),
    PresetFigure(
        "bearings.offset",
        "bearings: their middle beside the joint's origin, along the axis",
        "0 mm",
        "60 mm",
        "120 mm",
        "assumption: half the length of a main bearing with its gear",
    ),
    PresetFigure(
        "truth.links",
        "links: factor on the bending stiffness",
        1.0,
        1.0,
        0.7,
        "assumption: walls of 10 mm; harsh 7 mm",
    ),
    PresetFigure(
        "balancer.seal_friction",
        "gravity compensator: friction of its seals",
        "0 N",
        "300 N",
        "600 N",
        "assumption: 1.5 and 3 % of its force of some 20 kN",
    ),
    PresetFigure(
        "contact.tilt",
        "contact: disk not flat on the tooling, standard deviation of a visit",
        "0 deg",
        "0.2 deg",
        "0.4 deg",
        "assumption: a fifteenth of `engagement.normal_tolerance` (3 deg)",
    ),
    PresetFigure(
        "contact.wander",
        "contact: point of attack on the disk, standard deviation of a load case",
        "0 mm",
        "2 mm",
        "4 mm",
        "assumption: a tenth of the disk's radius (25 mm)",
    ),
    PresetFigure(
        "contact.process_stiffness",
        "process: force per shift along the surface's normal",
        "0 N/mm",
        "100 N/mm",
        "200 N/mm",
        "assumption: a soft roller yields by 5 to 10 mm under 1 kN; a milling force changes as much"
        " by a tenth of a millimetre of depth",
    ),
    PresetFigure(
        "controller.repeatability",
        "controller: error of a stop, each axis",
        "0.01 mm",
        "0.02 mm",
        "0.04 mm",
        "data sheets of KR QUANTEC †: pose repeatability 0.05 to 0.06 mm (ISO 9283: mean distance"
        " and three standard deviations)",
    ),
    PresetFigure(
        "sensor.cross_talk",
        "force sensor: cross-talk, over the ranges",
        0.001,
        0.01,
        0.02,
        "data sheets of ATI Omega †: uncertainty of 1 to 1.5 % of full scale; Humanetics"
        " (hitec.humaneticsgroup.com): cross-talk of 1 to 5 % before it is calibrated away",
    ),
    PresetFigure(
        "sensor.hysteresis",
        "force sensor: way up against way down, over the load",
        0.0,
        0.005,
        0.01,
        "part of the uncertainty above; Koike, Sakaino, Tsuji 2019 correct for it; share assumed",
    ),
    PresetFigure(
        "geometry.tcp",
        "geometry: length of the tool's error",
        "0 mm",
        "1 mm",
        "2 mm",
        "four-point teaching of a tool is good to about 1 mm (assumption)",
    ),
    PresetFigure(
        "geometry.links",
        "geometry: error of each link's length and offset",
        "0 mm",
        "0.5 mm",
        "1 mm",
        "a KR 210 off by 1.2 mm in the mean before its calibration (doi 10.1177/1729881420921644):"
        " six links of 0.5 mm",
    ),
    PresetFigure(
        "thermal.drift",
        "temperature: tool at HOME, warm against cold",
        "0 um",
        "50 um",
        "100 um",
        "Vocetka et al. 2021 (doi 10.3390/app112210813): cold against warm up to ten times the"
        " repeatability; 50 um is a warmed-up robot",
    ),
)
_BY_KEY = {figure.key: figure for figure in PRESET_FIGURES}
_INSTEAD = {"gears.lost_motion": ("hysteresis", "reference_angle")}
"""Figures that are left out where a file says the same in other words."""


def kind_default(key: str) -> Any:
    """Return the field of a section whose default is the figure of the preset `kind`."""
    return Field(default=_BY_KEY[key].kind, validate_default=True)


def with_preset(data: dict[str, Any], preset: Preset) -> dict[str, Any]:
    """Return a section ``simulation`` with the figures of a preset where it says nothing else.

    Parameters
    ----------
    data : dict
        The section as it stands in a file.
    preset : str
        Which.
    """
    filled = dict(data)
    for figure in PRESET_FIGURES:
        section, name = figure.key.split(".")
        own = filled.get(section, {})
        if not isinstance(own, dict) or {name, *_INSTEAD.get(figure.key, ())} & own.keys():
            continue  # said otherwise, or no section at all: refused later by its path
        filled[section] = own | {name: figure.of(preset)}
    return filled
