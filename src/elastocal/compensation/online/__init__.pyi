from .compensator import Compensator as Compensator
from .design import (
    JOINT_RANGE as JOINT_RANGE,
    LONG_AGO as LONG_AGO,
    Design as Design,
    design as design,
)
from .state import (
    Correction as Correction,
    Reading as Reading,
    State as State,
    Status as Status,
    rkorr as rkorr,
)
