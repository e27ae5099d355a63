from .cross_validation import cross_validate as cross_validate
from .data import CodecData as CodecData, SpringLabels as SpringLabels
from .data_file import (
    ARRAYS as ARRAYS,
    ARRAYS_SCHEMA as ARRAYS_SCHEMA,
    read_codec as read_codec,
    write_codec as write_codec,
)
from .index_correlation import Correlation as Correlation
from .index_file import write_index_table as write_index_table
from .indices import INDICES as INDICES, IndexValues as IndexValues
from .insight import Insight as Insight, look_into as look_into
from .observed import Observed as Observed
from .options import CodecOptions as CodecOptions
from .pairs import Pair as Pair, paired as paired
from .saturation import Saturation as Saturation, Tolerance as Tolerance, saturation as saturation
from .splits import Split as Split, make_splits as make_splits, split_sizes as split_sizes
from .training import AXES as AXES
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
