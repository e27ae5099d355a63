from .conditions import (
    Condition as Condition,
    condition_name as condition_name,
    make_conditions as make_conditions,
    read_variations as read_variations,
    value_text as value_text,
)
from .poses import (
    PoseChoice as PoseChoice,
    StudyPool as StudyPool,
    choose_poses as choose_poses,
    study_poses as study_poses,
)
from .samples import (
    DESIGN as DESIGN,
    DESIGN_SCHEMA as DESIGN_SCHEMA,
    PART_SCHEMA as PART_SCHEMA,
    PARTS as PARTS,
    ConditionResult as ConditionResult,
    Purpose as Purpose,
    Sample as Sample,
    SampleResult as SampleResult,
    SpringLabel as SpringLabel,
    StudyDesign as StudyDesign,
    StudyStore as StudyStore,
    Verification as Verification,
    calibrated as calibrated,
    read_design as read_design,
    read_part as read_part,
)
from .sampling import (
    batch_executor as batch_executor,
    check_samples as check_samples,
    run_study as run_study,
)
from .show import show_study as show_study
from .summary import (
    STUDY_SCHEMA as STUDY_SCHEMA,
    StudySummary as StudySummary,
    micrometres as micrometres,
    read_study as read_study,
    study_summary as study_summary,
    write_study as write_study,
)
