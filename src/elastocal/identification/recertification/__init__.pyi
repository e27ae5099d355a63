from .comparison import (
    check_same_robot as check_same_robot,
    recertify as recertify,
    recertify_files as recertify_files,
)
from .record import (
    ComparisonRecord as ComparisonRecord,
    comparison_record as comparison_record,
    figures as figures,
    read_comparison as read_comparison,
    write_comparison as write_comparison,
)
from .result import (
    DeflectionChange as DeflectionChange,
    Estimate as Estimate,
    Recertification as Recertification,
    SpringChange as SpringChange,
    Verdict as Verdict,
)
