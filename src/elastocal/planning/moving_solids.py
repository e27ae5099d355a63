"""Arm and tool as what may stand between a marker and a station."""

from dataclasses import dataclass, field

import numpy as np

from elastocal.arrays import BoolArray, FloatArray
from elastocal.planning.scene import CollisionScene
from elastocal.planning.sight_lines import Beams, Solid
from elastocal.planning.sight_solids import solid_of

SEAT = 5e-3
"""Distance from the marker, in m, from which on arm and tool count: a marker sits on something."""

HOUSED = 1e-3
"""A tool shape that the marker lies deeper in than this, in m, is taken as its housing. A marker
less deep, on a face that is drawn a little too high, still sees through `SEAT` of it: all within
78 deg (arc cosine of 1 mm over 5 mm) of the face's normal."""


@dataclass(frozen=True, eq=False)
class MovingSolids:
    """The collision shapes of links and tool, as solids that stop a beam.

    A shape stops a beam that is inside it anywhere from `SEAT` off the marker to the station. One
    rule keeps a marker from being blinded by what holds it: a shape of the tool in which the
    marker lies deeper than `HOUSED` is drawn wider than the tool is, and stops only a beam that
    enters it again from outside. A convex shape is never entered again and so never stops any; a
    hollow mesh may. Links have no such exception.
    """

    scene: CollisionScene
    marker_tcp: FloatArray
    """Marker in the tcp frame, shape (3,), in m."""
    housings: tuple[str, ...] = field(init=False)
    """Names of the tool's shapes that hold the marker."""
    _solids: tuple[Solid, ...] = field(init=False, repr=False)
    _holds: tuple[bool, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        bodies = self.scene.moving(np.empty((0, len(self.scene.robot.joint_names))))
        solids = tuple(solid_of(body.name, body.shape) for body in bodies)
        tool = self.scene.tool
        links = len(bodies) - len(tool)
        holds = [
            solid.depth(_seen_from(body.T_frame_body, self.marker_tcp)) > HOUSED
            for body, solid in zip(tool, solids[links:], strict=True)
        ]
        names = tuple(body.name for body, held in zip(tool, holds, strict=True) if held)
        object.__setattr__(self, "housings", names)
        object.__setattr__(self, "_solids", solids)
        object.__setattr__(self, "_holds", (*[False] * links, *holds))

    def hide(self, q: FloatArray, beams: Beams) -> BoolArray:
        """Return whether links or tool stand in the way of each beam.

        Parameters
        ----------
        q : ndarray, shape (pose, joint)
            Joint positions in rad or m.
        beams : Beams
            The beam from the marker at each posture, in base, shape (pose,).

        Returns
        -------
        ndarray of bool, shape (pose,)
        """
        hidden = np.zeros(len(beams), dtype=bool)
        bodies = self.scene.moving(q)
        for body, solid, holds in zip(bodies, self._solids, self._holds, strict=True):
            here = beams.seen_from(body.T_frame_body)
            hidden |= solid.crosses_again(here) if holds else solid.crosses(here, SEAT)
        return hidden


def _seen_from(T: FloatArray, point: FloatArray) -> FloatArray:
    seen: FloatArray = T[:3, :3].T @ (point - T[:3, 3])
    return seen
