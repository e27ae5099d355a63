from .conditions import (
    FACTORS as FACTORS,
    Condition as Condition,
    Factor as Factor,
    Value as Value,
    condition_name as condition_name,
    make_conditions as make_conditions,
    read_variation as read_variation,
    read_variations as read_variations,
    value_text as value_text,
)
from .poses import (
    PoseChoice as PoseChoice,
    StudyPool as StudyPool,
    StudyPoses as StudyPoses,
    choose_poses as choose_poses,
    study_poses as study_poses,
)
from .samples import (
    ConditionResult as ConditionResult,
    Purpose as Purpose,
    Sample as Sample,
    SampleResult as SampleResult,
    Simulate as Simulate,
    Verification as Verification,
    calibrated as calibrated,
)
from .sampling import (
    Spread as Spread,
    Work as Work,
    check_samples as check_samples,
    one_after_the_other as one_after_the_other,
    run_study as run_study,
    spread_over as spread_over,
)
from .store import (
    DESIGN as DESIGN,
    DESIGN_SCHEMA as DESIGN_SCHEMA,
    PART_SCHEMA as PART_SCHEMA,
    PARTS as PARTS,
    SpringLabel as SpringLabel,
    StudyDesign as StudyDesign,
    StudyStore as StudyStore,
    read_design as read_design,
    read_part as read_part,
)
from .summary import (
    STUDY_SCHEMA as STUDY_SCHEMA,
    ConditionSummary as ConditionSummary,
    Distribution as Distribution,
    Share as Share,
    StudySummary as StudySummary,
    advice as advice,
    distribution as distribution,
    micrometres as micrometres,
    read_study as read_study,
    share as share,
    study_summary as study_summary,
    summarise as summarise,
    write_study as write_study,
)
