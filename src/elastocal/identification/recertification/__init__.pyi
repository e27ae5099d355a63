from .arms import (
    ComparedRows as ComparedRows,
    check_same_robot as check_same_robot,
)
from .comparison import (
    recertify as recertify,
    recertify_files as recertify_files,
)
from .result import (
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
from .show import show_comparison as show_comparison
