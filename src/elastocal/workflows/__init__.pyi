from ._outputs import refuse_overwriting as refuse_overwriting
from ._robot_source import find_robot as find_robot
from .calibrate import (
    CalibrateResult as CalibrateResult,
    CalibrateSettings as CalibrateSettings,
    calibrate as calibrate,
)
from .predict import (
    PredictResult as PredictResult,
    PredictSettings as PredictSettings,
    predict as predict,
)
from .study import (
    DEFAULT_VARIATION as DEFAULT_VARIATION,
    StudyResult as StudyResult,
    StudySettings as StudySettings,
    study as study,
    study_conditions as study_conditions,
)
