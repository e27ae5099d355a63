"""How fast the program drives, and how long that takes."""

import math
from dataclasses import dataclass

from elastocal.planning.plan_file import PlanFile, PoseRecord

PTP_PERCENT = 10
"""Fastest PTP moves, in percent of the axes' largest speeds."""
LIN_SPEED = 0.05
"""Fastest motion between approach pose and near contact, in m/s."""
TOUCH_SPEED = 0.005
"""Fastest motion between near contact and the surface, in m/s."""


@dataclass(frozen=True)
class Speeds:
    """Speeds of a program: those of the cell, but never above the limits of this module."""

    ptp_percent: int
    """Of PTP moves, in percent of the axes' largest speeds."""
    lin: float
    """Between approach pose and near contact, in m/s."""
    touch: float
    """Between near contact and the surface, in m/s."""

    def contact_time(self, plan: PlanFile, pose: PoseRecord) -> float:
        """Return the seconds from the approach pose through all load cases and back to it.

        The plan's own figure is for one speed from approach pose to contact; the retreat to near
        contact is at the touch speed too.
        """
        contact = plan.contact
        far = contact.approach_distance - contact.near_contact
        planned = 2.0 * contact.approach_distance / contact.contact_speed
        driven = 2.0 * (far / self.lin + contact.near_contact / self.touch)
        return pose.contact_time - planned + driven

    def total_time(self, plan: PlanFile) -> float:
        """Return the seconds from HOME to HOME, all load cases included.

        Moves of axes take longer in the ratio of the speeds; their ramps are counted so too,
        which is on the safe side.
        """
        slower = 100.0 * plan.contact.axis_override / self.ptp_percent
        return slower * plan.travel_time + sum(self.contact_time(plan, p) for p in plan.poses)


def speeds_of(plan: PlanFile) -> Speeds:
    """Return the speeds of a plan's program.

    Parameters
    ----------
    plan : PlanFile
        The plan, with the speeds of its cell.
    """
    contact = plan.contact
    # A whole percent, and KRL knows none below 1.
    percent = max(1, math.floor(100.0 * contact.axis_override + 1e-9))
    lin, touch = (min(contact.contact_speed, limit) for limit in (LIN_SPEED, TOUCH_SPEED))
    return Speeds(min(PTP_PERCENT, percent), lin, touch)
