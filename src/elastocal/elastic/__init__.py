"""Springs, spring layouts and the elastic model of a robot (paper Eq. 1-14)."""

from elastocal.elastic.layouts import LAYOUTS, layout
from elastocal.elastic.model import CartesianCompliance, ElasticModel, spring_torques
from elastocal.elastic.springs import Spring

__all__ = [
    "LAYOUTS",
    "CartesianCompliance",
    "ElasticModel",
    "Spring",
    "layout",
    "spring_torques",
]
