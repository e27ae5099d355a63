from .calibration import (
    PairCalibration as PairCalibration,
    identify_pair as identify_pair,
)
from .cell import (
    PAIR_FILE as PAIR_FILE,
    SCHEMA as SCHEMA,
    PairCell as PairCell,
    is_pair_cell as is_pair_cell,
    load_pair_cell as load_pair_cell,
    write_pair_example as write_pair_example,
)
from .cooperation import (
    CooperationSummary as CooperationSummary,
    cooperation_summary as cooperation_summary,
    correct_pair as correct_pair,
)
from .meetings import (
    PairPlan as PairPlan,
    plan_meetings as plan_meetings,
)
from .presses import (
    pair_readings as pair_readings,
    require_opposed as require_opposed,
)
from .result import PairResult as PairResult
