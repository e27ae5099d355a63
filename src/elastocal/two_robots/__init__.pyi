from .calibration import (
    PairCalibration as PairCalibration,
    calibrate_pair as calibrate_pair,
)
from .cell import (
    PairCell as PairCell,
    is_pair_cell as is_pair_cell,
    load_pair_cell as load_pair_cell,
)
from .presses import (
    PairReadings as PairReadings,
    pair_readings as pair_readings,
)
