"""Straight moves to the surface and away from it."""

import math
from dataclasses import dataclass, replace

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.sim.workcell.contact import Contact
from elastocal.sim.workcell.force_control import ForceControl
from elastocal.sim.workcell.plant import Plant
from elastocal.sim.workcell.quasistatics import Stand
from elastocal.sim.workcell.ways import Way, line_way, pressed, touching
