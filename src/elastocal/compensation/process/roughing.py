"""Rings of a dome that is roughed from the top of a block (paper section 4.3, Fig. 13).

Feed 70 mm/s and 12 000 rpm are the paper's; a cutter of two teeth then passes 400 teeth a second
over a run-out line at 200 Hz. The paper gives neither the dome nor the forces: both are assumed,
the forces within the load cases of its Fig. 12 (500 N aside, 1500 N along the tool).
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.random import Generator

from elastocal.arrays import FloatArray
from elastocal.compensation.process.course import (
    Course,
    Process,
    Ripple,
    engaged,
    evenly_spaced,
    swing,
    tool_frames,
    unit_tangents,
)
from elastocal.compensation.settings import CompensatorSettings
from elastocal.planning.surface import Surface
from elastocal.results import brief_repr

_SPINDLE = 12_000.0 / 60.0
"""In Hz."""


@brief_repr
@dataclass(frozen=True)
class Roughing(Process):
    """Rings about the middle of a block's top; deviations count normal to the dome.

    The tool's axis stays square to the top. Frames: the block's z points up, as in its file.
    """

    radius: float = 0.14
    """Radius of the lowest ring, in m."""
    disk: float = 0.05
    """Radius of the disk on top that is not machined (Fig. 13), in m."""
    height: float = 0.06
    """From the lowest ring to the top of the dome, in m."""
    speed: float = 0.07
    """In m/s."""
    step: float = 0.02
    """Time between rows, in s."""
    tangential: float = 350.0
    """Against the feed, in N."""
    normal: float = 350.0
    """Away from the part, in N."""
    across: float = 120.0
    """Along the part, square to the feed, in N."""
    engagement: tuple[float, float] = (0.7, 1.2)
    """Factor of a ring on all forces, drawn between these."""
    swing: float = 0.25
    """Share by which the depth of the cut, and with it the force, changes along a ring."""
    roll_in: float = 0.02
    """Length over which the cutter rolls in and out, in m."""
    ripple: tuple[Ripple, ...] = (Ripple(2.0 * _SPINDLE, 0.4), Ripple(_SPINDLE, 0.15))

    direction: ClassVar[str] = "normal to the part"
    # The lines at 200 and 400 Hz cannot be notched at a cycle of 4 ms: readings come every 1 ms.
    compensator: ClassVar[CompensatorSettings] = CompensatorSettings.model_validate(
        {
            "filter": {
                "sample": "1 ms",
                "notches": [
                    {"frequency": f"{_SPINDLE:g} Hz", "width": "20 Hz"},
                    {"frequency": f"{2.0 * _SPINDLE:g} Hz", "width": "20 Hz"},
                ],
                "low_pass": {"cutoff": "25 Hz"},
                "lead": "32 ms",
            }
        }
    )

    def courses(self, surface: Surface, rng: Generator) -> tuple[Course, ...]:
        """Return rings about the middle of the block's top; see `Process.courses`."""
        T = surface.T_base_surface
        own = (surface.mesh.vertices - T[:3, 3]) @ T[:3, :3]
        middle, top = 0.5 * (own.min(axis=0) + own.max(axis=0)), own[:, 2].max()
        apex = np.array([middle[0], middle[1], top])
        radii = np.linspace(self.disk, self.radius, self.count + 1)[1:]
        return tuple(
            self._ring(f"ring {n + 1}", T, apex, float(radius), rng)
            for n, radius in enumerate(radii)
        )

    def _ring(
        self,
        name: str,
        T_base_surface: FloatArray,
        apex: FloatArray,
        radius: float,
        rng: Generator,
    ) -> Course:
        R = T_base_surface[:3, :3]
        sphere = (self.radius**2 + self.height**2) / (2.0 * self.height)
        angle = np.linspace(0.0, 2.0 * np.pi, 721)
        flat = np.stack([np.cos(angle), np.sin(angle), np.zeros(len(angle))], axis=1)
        depth = np.sqrt(sphere**2 - radius**2) - sphere
        own = apex + radius * flat + (0.0, 0.0, depth)
        path = evenly_spaced(own @ R.T + T_base_surface[:3, 3], self.speed, self.step)
        centre = R @ (apex - (0.0, 0.0, sphere)) + T_base_surface[:3, 3]
        normal = (path - centre) / sphere
        forward = unit_tangents(path)
        across = np.cross(normal, forward)
        time = np.arange(float(len(path))) * self.step
        cut = rng.uniform(*self.engagement) * (1.0 + self.swing * swing(time, rng))
        cut *= engaged(time, self.roll_in / self.speed)
        force = cut[:, None] * (
            self.normal * normal - self.tangential * forward + self.across * across
        )
        still = np.ones((len(path), 1))
        T = tool_frames(path, still * R[:, 0], -still * R[:, 2])
        return Course(name, self.step, T, force, normal, self.ripple, normal=normal)
