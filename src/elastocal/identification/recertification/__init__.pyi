from .comparison import (
    check_same_robot as check_same_robot,
    recertify as recertify,
    recertify_files as recertify_files,
)
from .result import (
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
