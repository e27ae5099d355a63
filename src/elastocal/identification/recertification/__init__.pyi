from .arms import (
    ComparedRows as ComparedRows,
    arm_notes as arm_notes,
    check_same_robot as check_same_robot,
    count_outside_limits as count_outside_limits,
    model_on as model_on,
)
from .comparison import (
    recertify as recertify,
    recertify_files as recertify_files,
)
from .result import (
    LEAST_COVERED as LEAST_COVERED,
    SCHEMA as SCHEMA,
    CommonGround as CommonGround,
    CompareResult as CompareResult,
    CompareSummary as CompareSummary,
    DeflectionChange as DeflectionChange,
    Estimate as Estimate,
    LargestChange as LargestChange,
    RowComparison as RowComparison,
    SpringChange as SpringChange,
    Verdict as Verdict,
)
