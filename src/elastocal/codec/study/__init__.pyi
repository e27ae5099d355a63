from .calibrating import Verification as Verification, calibrated as calibrated
from .factors import (
    FACTORS as FACTORS,
    Condition as Condition,
    make_conditions as make_conditions,
    read_variation as read_variation,
    read_variations as read_variations,
)
from .files import (
    STUDY_SCHEMA as STUDY_SCHEMA,
    StudyRecord as StudyRecord,
    read_study as read_study,
    study_record as study_record,
    write_study as write_study,
)
from .running import (
    Spread as Spread,
    Work as Work,
    check_samples as check_samples,
    one_after_the_other as one_after_the_other,
    run_study as run_study,
)
from .samples import (
    Accuracy as Accuracy,
    Outcome as Outcome,
    Purpose as Purpose,
    Sample as Sample,
    SampleResult as SampleResult,
    Simulate as Simulate,
)
from .settings import (
    SETTINGS_SCHEMA as SETTINGS_SCHEMA,
    ConditionRecord as ConditionRecord,
    SpringRecord as SpringRecord,
    StudySettings as StudySettings,
    name_of as name_of,
    written as written,
)
from .store import (
    PART_SCHEMA as PART_SCHEMA,
    PARTS as PARTS,
    SETTINGS as SETTINGS,
    StudyStore as StudyStore,
    read_part as read_part,
    read_settings as read_settings,
)
from .summary import Share as Share
