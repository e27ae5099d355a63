from ._device_sources import KINDS as KINDS, SOURCES as SOURCES, DeviceSource as DeviceSource
from ._operator import Operator as Operator, Supervision as Supervision, Unattended as Unattended
from ._outputs import refuse_overwriting as refuse_overwriting
from ._robot_source import find_robot as find_robot
from .calibrate import (
    CalibrateResult as CalibrateResult,
    CalibrateSettings as CalibrateSettings,
    calibrate as calibrate,
)
from .codec import CodecResult as CodecResult, CodecSettings as CodecSettings, codec as codec
from .compare import (
    CompareResult as CompareResult,
    CompareSettings as CompareSettings,
    compare as compare,
    measured_rows as measured_rows,
)
from .derive import DeriveResult as DeriveResult, DeriveSettings as DeriveSettings, derive as derive
from .plan import (
    PlanFigures as PlanFigures,
    PlanResult as PlanResult,
    PlanSettings as PlanSettings,
    plan as plan,
    plan_figures as plan_figures,
)
from .predict import (
    PredictResult as PredictResult,
    PredictSettings as PredictSettings,
    predict as predict,
)
from .report import (
    ReportFigures as ReportFigures,
    ReportResult as ReportResult,
    ReportSettings as ReportSettings,
    report as report,
)
from .run import (
    POSES_MEASURED as POSES_MEASURED,
    DryRunResult as DryRunResult,
    RunFigures as RunFigures,
    RunResult as RunResult,
    RunSettings as RunSettings,
    dry_run as dry_run,
    run as run,
)
from .study import (
    DEFAULT_VARIATION as DEFAULT_VARIATION,
    StudyResult as StudyResult,
    StudySettings as StudySettings,
    study as study,
    study_conditions as study_conditions,
)
