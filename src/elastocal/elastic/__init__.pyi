from .layouts import LAYOUTS as LAYOUTS, layout as layout
from .model import (
    CartesianCompliance as CartesianCompliance,
    ElasticModel as ElasticModel,
    check_vectors as check_vectors,
    spring_torques as spring_torques,
)
from .springs import Spring as Spring
