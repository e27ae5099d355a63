from .cell import CELL as CELL, INSTRUMENTS as INSTRUMENTS
from .codecs import CODECS as CODECS
from .compliances import COMPLIANCES as COMPLIANCES, RECERTIFICATION as RECERTIFICATION
from .judgement import (
    FINDINGS as FINDINGS,
    NOT_VERIFIED as NOT_VERIFIED,
    UNCERTAINTY as UNCERTAINTY,
)
from .poses import POSES as POSES
from .process import PROCESS as PROCESS
from .provenance import PROVENANCE as PROVENANCE
from .readings import READINGS as READINGS
