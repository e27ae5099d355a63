from .compensator import Compensator as Compensator, Conditioner as Conditioner
from .design import (
    JOINT_RANGE as JOINT_RANGE,
    LONG_AGO as LONG_AGO,
    Design as Design,
    design as design,
    draws_factor as draws_factor,
)
from .state import (
    Correction as Correction,
    Reading as Reading,
    State as State,
    Status as Status,
    Triple as Triple,
    rkorr as rkorr,
)
