from ._outputs import refuse_overwriting as refuse_overwriting
from ._process_trial import (
    ProcessTrial as ProcessTrial,
    TrialRuns as TrialRuns,
    run_trial as run_trial,
)
from ._robot_source import find_robot as find_robot
from .calibrate import (
    CalibrateResult as CalibrateResult,
    CalibrateSettings as CalibrateSettings,
    calibrate as calibrate,
)
from .compensate import (
    CompensateResult as CompensateResult,
    CompensateSettings as CompensateSettings,
    compensate as compensate,
)
from .export import ExportResult as ExportResult, ExportSettings as ExportSettings, export as export
from .predict import (
    PredictResult as PredictResult,
    PredictSettings as PredictSettings,
    predict as predict,
)
from .simulate_process import (
    SimulateProcessResult as SimulateProcessResult,
    SimulateProcessSettings as SimulateProcessSettings,
    simulate_process as simulate_process,
)
from .stiffness import (
    ChosenStiffness as ChosenStiffness,
    ExternalAxis as ExternalAxis,
    PostureCounts as PostureCounts,
    StiffnessResult as StiffnessResult,
    StiffnessSettings as StiffnessSettings,
    StiffnessSummary as StiffnessSummary,
    stiffness as stiffness,
)
from .tool import ToolResult as ToolResult, ToolSettings as ToolSettings, tool as tool
