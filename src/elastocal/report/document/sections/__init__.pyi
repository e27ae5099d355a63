from .cell import CELL as CELL
from .codecs import CODECS as CODECS
from .compliances import COMPLIANCES as COMPLIANCES
from .instruments import INSTRUMENTS as INSTRUMENTS
from .not_verified import NOT_VERIFIED as NOT_VERIFIED
from .poses import POSES as POSES
from .process import PAPER as PAPER, PROCESS as PROCESS, PublishedCase as PublishedCase
from .provenance import PROVENANCE as PROVENANCE
from .readings import READINGS as READINGS
from .recertification import RECERTIFICATION as RECERTIFICATION
