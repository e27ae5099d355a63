__all__ = [
    "calibrate",
    "calibrate_pair",
    "check",
    "codec",
    "compare",
    "compensate",
    "compensate_pair",
    "demo",
    "derive",
    "export",
    "geometry",
    "guess_map",
    "import_logs",
    "import_positions",
    "init",
    "krc_config",
    "live",
    "measure_delay",
    "new",
    "plan",
    "plan_pair",
    "predict",
    "release",
    "report",
    "run",
    "simulate",
    "simulate_pair",
    "simulate_process",
    "stiffness",
    "studio",
    "study",
    "tool",
    "touch",
    "verify",
    "watch",
]  # the commands: what the package itself exports of these

from ._live_session import LiveReport as LiveReport, LiveResult as LiveResult
from ._operator_and_devices import (
    Supervision as Supervision,
    Unattended as Unattended,
    rig_of as rig_of,
)
from .calibrate import (
    CalibrateResult as CalibrateResult,
    CalibrateSettings as CalibrateSettings,
    calibrate as calibrate,
)
from .check import (
    CheckResult as CheckResult,
    CheckSettings as CheckSettings,
    check as check,
)
from .codec import (
    CodecResult as CodecResult,
    CodecSettings as CodecSettings,
    codec as codec,
)
from .compare import (
    CompareResult as CompareResult,
    CompareSettings as CompareSettings,
    compare as compare,
    measured_rows as measured_rows,
)
from .compensate import (
    CompensateResult as CompensateResult,
    CompensateSettings as CompensateSettings,
    compensate as compensate,
)
from .demo import (
    Chapter as Chapter,
    DemoResult as DemoResult,
    DemoSettings as DemoSettings,
    demo as demo,
)
from .derive import (
    DeriveResult as DeriveResult,
    DeriveSettings as DeriveSettings,
    derive as derive,
)
from .export import (
    ExportResult as ExportResult,
    ExportSettings as ExportSettings,
    export as export,
)
from .geometry import (
    GeometryResult as GeometryResult,
    GeometrySettings as GeometrySettings,
    geometry as geometry,
)
from .import_logs import (
    GuessMapResult as GuessMapResult,
    GuessMapSettings as GuessMapSettings,
    ImportLogsResult as ImportLogsResult,
    ImportLogsSettings as ImportLogsSettings,
    ImportPositionsResult as ImportPositionsResult,
    ImportPositionsSettings as ImportPositionsSettings,
    guess_map as guess_map,
    import_logs as import_logs,
    import_positions as import_positions,
)
from .init import (
    InitResult as InitResult,
    InitSettings as InitSettings,
    init as init,
)
from .krc_config import (
    KrcConfigResult as KrcConfigResult,
    KrcConfigSettings as KrcConfigSettings,
    krc_config as krc_config,
)
from .live import (
    LiveSettings as LiveSettings,
    live as live,
    settings_within as settings_within,
)
from .measure_delay import (
    MeasureDelayResult as MeasureDelayResult,
    MeasureDelaySettings as MeasureDelaySettings,
    measure_delay as measure_delay,
)
from .new import (
    NewResult as NewResult,
    new as new,
)
from .new_settings import (
    NewSettings as NewSettings,
)
from .plan import (
    POSITION_PLAN as POSITION_PLAN,
    PlanFigures as PlanFigures,
    PlanPositionsSettings as PlanPositionsSettings,
    PlanResult as PlanResult,
    PlanSettings as PlanSettings,
    plan as plan,
    plan_figures as plan_figures,
    plan_positions as plan_positions,
)
from .predict import (
    PredictResult as PredictResult,
    PredictSettings as PredictSettings,
    predict as predict,
)
from .release import (
    ReleaseResult as ReleaseResult,
    ReleaseSettings as ReleaseSettings,
    release as release,
)
from .report import (
    ReportResult as ReportResult,
    ReportSettings as ReportSettings,
    report as report,
)
from .run import (
    DryRunResult as DryRunResult,
    RunFigures as RunFigures,
    RunResult as RunResult,
    RunSettings as RunSettings,
    dry_run as dry_run,
    run as run,
)
from .simulate import (
    Ports as Ports,
    SimulateResult as SimulateResult,
    SimulateSettings as SimulateSettings,
    simulate as simulate,
)
from .simulate_process import (
    ProcessTrial as ProcessTrial,
    SimulateProcessResult as SimulateProcessResult,
    SimulateProcessSettings as SimulateProcessSettings,
    TrialRuns as TrialRuns,
    run_loads as run_loads,
    simulate_process as simulate_process,
)
from .stiffness import (
    ChosenStiffness as ChosenStiffness,
    ExternalAxis as ExternalAxis,
    StiffnessResult as StiffnessResult,
    StiffnessSettings as StiffnessSettings,
    StiffnessSummary as StiffnessSummary,
    stiffness as stiffness,
)
from .studio import (
    StudioResult as StudioResult,
    StudioSettings as StudioSettings,
    studio as studio,
)
from .study import (
    StudyResult as StudyResult,
    StudySettings as StudySettings,
    study as study,
)
from .tool import (
    ToolResult as ToolResult,
    ToolSettings as ToolSettings,
    tool as tool,
)
from .touch import (
    ArmGrowth as ArmGrowth,
    TouchSettings as TouchSettings,
    touch as touch,
)
from .two_robots import (
    CalibratePairSettings as CalibratePairSettings,
    CompensatePairSettings as CompensatePairSettings,
    CooperationSummary as CooperationSummary,
    PairPlan as PairPlan,
    PairResult as PairResult,
    PlanPairSettings as PlanPairSettings,
    SimulatePairResult as SimulatePairResult,
    SimulatePairSettings as SimulatePairSettings,
    calibrate_pair as calibrate_pair,
    compensate_pair as compensate_pair,
    plan_pair as plan_pair,
    simulate_pair as simulate_pair,
)
from .verify import (
    VerifyResult as VerifyResult,
    VerifySettings as VerifySettings,
    verify as verify,
)
from .watch import (
    WatchResult as WatchResult,
    WatchSettings as WatchSettings,
    watch as watch,
)
