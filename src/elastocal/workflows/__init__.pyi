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
from ._device_sources import DeviceSource as DeviceSource, KINDS as KINDS, SOURCES as SOURCES
from .derive import DeriveResult as DeriveResult, DeriveSettings as DeriveSettings, derive as derive
from .run import (
    DryRunResult as DryRunResult,
    Operator as Operator,
    POSES_MEASURED as POSES_MEASURED,
    RunFigures as RunFigures,
    RunResult as RunResult,
    RunSettings as RunSettings,
    Supervision as Supervision,
    Unattended as Unattended,
    dry_run as dry_run,
    run as run,
)
from .plan import PlanFigures as PlanFigures, PlanResult as PlanResult, PlanSettings as PlanSettings, plan as plan, plan_figures as plan_figures
