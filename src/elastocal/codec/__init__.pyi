from .analysis import (
    CodecAnalysis as CodecAnalysis,
    SpringObservability as SpringObservability,
    analyse as analyse,
)
from .cross_validation import cross_validate as cross_validate
from .data import (
    AXES as AXES,
    NO_POSE as NO_POSE,
    CodecData as CodecData,
    SpringLabels as SpringLabels,
)
from .index_correlation import Correlation as Correlation
from .index_file import write_index_table as write_index_table
from .indices import INDICES as INDICES, IndexValues as IndexValues
from .netcdf import (
    ARRAYS as ARRAYS,
    ARRAYS_SCHEMA as ARRAYS_SCHEMA,
    read_codec as read_codec,
    write_codec as write_codec,
)
from .paired_differences import (
    PairedDifference as PairedDifference,
    paired_difference as paired_difference,
)
from .saturation import (
    Saturation as Saturation,
    Tolerance as Tolerance,
    find_saturation as find_saturation,
)
from .splits import (
    CodecOptions as CodecOptions,
    Split as Split,
    make_splits as make_splits,
    split_sizes as split_sizes,
)
from .variants import (
    ALL_LOADS as ALL_LOADS,
    KEYS as KEYS,
    SOLVERS as SOLVERS,
    Variant as Variant,
    make_variants as make_variants,
    read_comparison as read_comparison,
    training_cases as training_cases,
)
from .verdict_file import (
    VERDICTS as VERDICTS,
    VERDICTS_SCHEMA as VERDICTS_SCHEMA,
    VerdictRecord as VerdictRecord,
    figures as figures,
    read_verdicts as read_verdicts,
    verdict_record as verdict_record,
    write_verdicts as write_verdicts,
)
from .verdicts import Verdicts as Verdicts, judge as judge
