from .derivation import (
    DerivedRun as DerivedRun,
    derive_poses as derive_poses,
    derive_run as derive_run,
    write_derived as write_derived,
)
from .displacement import (
    LoadRow as LoadRow,
    LoadValues as LoadValues,
    load_rows as load_rows,
    make_dataset as make_dataset,
)
from .readings import (
    Mean as Mean,
    PoseReadings as PoseReadings,
    Reading as Reading,
    ToolState as ToolState,
    average as average,
    marker_readings as marker_readings,
    reduce_pose as reduce_pose,
    robot_errors as robot_errors,
    tool_readings as tool_readings,
    weighed_poses as weighed_poses,
)
from .summary import (
    RunFindings as RunFindings,
    read_summary as read_summary,
    run_warnings as run_warnings,
    summarise as summarise,
)
from .tool import (
    Interval as Interval,
    RawWrench as RawWrench,
    RobotWrench as RobotWrench,
    ToolChange as ToolChange,
    ToolEstimate as ToolEstimate,
    ToolLoad as ToolLoad,
    UnloadedWrenches as UnloadedWrenches,
    estimate_tool as estimate_tool,
    tool_change as tool_change,
    turned_sigma as turned_sigma,
    wrench_on_robot as wrench_on_robot,
)
