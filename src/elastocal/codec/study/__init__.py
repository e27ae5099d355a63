"""Study: Monte-Carlo over simulated cells, before anybody travels.

Pure: what is simulated comes in as a function of the sample, where it is done as a function that
spreads batches. `elastocal.cli.study_simulation` and `elastocal.cli.study_spread` bring both.

==============  =================================================================================
`factors`       what may be varied; conditions
`samples`       sample, its generators, its result
`calibrating`   fit, and accuracy at unseen poses
`settings`      what a study is a study of
`store`         folder with finished samples; a killed study goes on
`running`       batches
`summary`       medians, quantiles, shares with intervals
`files`         tidy tables and ``study.json``
==============  =================================================================================
"""

from elastocal.codec.study.calibrating import Verification, calibrated
from elastocal.codec.study.factors import (
    FACTORS,
    Condition,
    make_conditions,
    read_variation,
    read_variations,
)
from elastocal.codec.study.files import StudyRecord, read_study, study_record, write_study
from elastocal.codec.study.running import check_samples, one_after_the_other, run_study
from elastocal.codec.study.samples import (
    Accuracy,
    Outcome,
    Purpose,
    Sample,
    SampleResult,
    Simulate,
)
from elastocal.codec.study.settings import ConditionRecord, SpringRecord, StudySettings
from elastocal.codec.study.store import StudyStore

__all__ = [
    "FACTORS",
    "Accuracy",
    "Condition",
    "ConditionRecord",
    "Outcome",
    "Purpose",
    "Sample",
    "SampleResult",
    "Simulate",
    "SpringRecord",
    "StudyRecord",
    "StudySettings",
    "StudyStore",
    "Verification",
    "calibrated",
    "check_samples",
    "make_conditions",
    "one_after_the_other",
    "read_study",
    "read_variation",
    "read_variations",
    "run_study",
    "study_record",
    "write_study",
]
