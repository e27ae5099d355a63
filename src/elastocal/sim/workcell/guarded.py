"""Straight moves to the surface, guarded by the force, and away from it."""

from dataclasses import dataclass, replace

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.sim.workcell.contact import Contact
from elastocal.sim.workcell.plant import Plant
from elastocal.sim.workcell.quasistatics import Stand
from elastocal.sim.workcell.ways import Way, line_way, pressed, touching

_BEYOND = 0.02
"""How far beyond its end a move looks for the surface, in m: the arm sags."""
_LAST_TOUCH = 1e-4
"""Shortest way on which a force fades when the tool leaves, in m."""


@dataclass(frozen=True, eq=False)
class Guarded:
    """How a guarded move ends."""

    way: Way
    contact: Contact | None
    """The tooling that is touched."""
    felt: bool
    """Whether the contact force was reached."""
    length: float
    """In m."""
    fault: str | None = None


def guarded_way(
    plant: Plant,
    start: Stand,
    direction: FloatArray,
    distance: float,
    guard: tuple[float, float],
) -> Guarded:
    """Return a straight move that ends at a distance or when a force is felt.

    The arm stops a reaction time after the force is felt, so that the force overshoots by what
    robot, disk and tooling build up meanwhile.

    Parameters
    ----------
    plant : Plant
        The cell.
    start : Stand
        Where the robot stands.
    direction : ndarray, shape (3,)
        Unit vector in base.
    distance : float
        Longest way, in m.
    guard : tuple of float
        Speed in m/s, and the force to stop at, in N.
    """
    statics, error = plant.statics, plant.stop_error()
    found = _touch(plant, start, direction, distance, error)
    if found is None:
        end = _moved(plant, start, distance * direction, error)
        return Guarded(line_way(statics, [start, end]), None, False, distance)
    contact, touch = found
    entry = plant.cell.file.simulation.controller
    speed, limit = guard[0], min(guard[1], entry.collision_force)

    def press(force: float) -> Stand:
        return pressed(statics, touch, contact, lambda _: -force * direction, error)

    to_touch = _way_to(plant, start, touch, direction)
    stiffness = limit / (_way_to(plant, start, press(limit), direction) - to_touch)
    felt = to_touch + limit / stiffness <= distance
    force = limit + stiffness * speed * entry.reaction if felt else 0.0
    force = force or stiffness * max(distance - to_touch, 0.0)
    end = press(force) if force > 0.0 else touch
    on_the_way = [touch] if to_touch > 0.0 and end is not touch else []
    fault = None
    if felt and guard[1] > entry.collision_force:
        fault = f"collision: {entry.collision_force:g} N on a straight move"
    length = max(_way_to(plant, start, end, direction), 0.0)
    way = line_way(statics, [start, *on_the_way, end])
    return Guarded(way, contact, felt, length, fault)


def retract_way(
    plant: Plant, start: Stand, direction: FloatArray, distance: float
) -> tuple[Way, Contact | None]:
    """Return a straight move away from the surface, and the contact that is left.

    The force fades evenly until the tool is where it touched.

    Parameters
    ----------
    plant : Plant
        The cell.
    start : Stand
        Where the robot stands.
    direction : ndarray, shape (3,)
        Unit vector in base, away from the surface.
    distance : float
        In m.
    """
    statics, error, contact = plant.statics, plant.stop_error(), plant.contact
    fades = 0.0
    if contact is not None and np.any(start.force):
        touched = replace(start, q=contact.q_touch)
        fades = max(_way_to(plant, start, touched, direction), _LAST_TOUCH)
    if fades > distance:
        left = (1.0 - distance / fades) * start.force
        q = _moved(plant, start, distance * direction, error).q
        return line_way(statics, [start, statics.loaded(start, q, left, error)]), contact
    stands = [start]
    if fades > 0.0:
        stands.append(_moved(plant, start, fades * direction, error))
    stands.append(_moved(plant, stands[-1], (distance - fades) * direction, error))
    return line_way(statics, stands), None


def _touch(
    plant: Plant, start: Stand, direction: FloatArray, distance: float, error: FloatArray
) -> tuple[Contact, Stand] | None:
    """Return contact and stand where the tool touches the tooling; None when it does not."""
    statics = plant.statics
    if plant.contact is not None:
        return plant.contact, statics.free(plant.contact.q_touch, error, start.theta)
    if any(fault.kind == "contact_missed" for fault in plant.schedule.at(plant.visit)):
        return None
    tool = statics.tool_position(start)
    hit = plant.surface.hit(tool, direction, distance + _BEYOND)
    if hit is None:
        return None
    point = tool + hit.distance * direction
    touch = touching(statics, start, point, error)
    if _way_to(plant, start, touch, direction) > distance:
        return None
    R = statics.robot.forward(start.q)[:3, :3]
    return Contact(plant.contact_law, point, R, hit.normal, touch.q), touch


def _moved(plant: Plant, start: Stand, way: FloatArray, error: FloatArray) -> Stand:
    """Return the robot free, its tool commanded elsewhere, orientation kept."""
    T = plant.statics.robot.forward(start.q)
    q = plant.statics.along(start.q, T[:3, :3], (T[:3, 3] + way)[None])[0]
    return plant.statics.free(q, error, start.theta)


def _way_to(plant: Plant, start: Stand, end: Stand, direction: FloatArray) -> float:
    """Return how far the commanded tool goes along a direction, in m."""
    T = plant.statics.robot.forward(np.stack([start.q, end.q]))
    return float((T[1, :3, 3] - T[0, :3, 3]) @ direction)
