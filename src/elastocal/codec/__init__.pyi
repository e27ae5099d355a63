from ._prepared import (
    PreparedVariant as PreparedVariant,
    prepared_variants as prepared_variants,
)
from .analysis import (
    CodecAnalysis as CodecAnalysis,
    SpringObservability as SpringObservability,
    analyse as analyse,
)
from .cross_validation import cross_validate as cross_validate
from .data import (
    ARRAYS as ARRAYS,
    ARRAYS_SCHEMA as ARRAYS_SCHEMA,
    AXES as AXES,
    NO_POSE as NO_POSE,
    CodecData as CodecData,
    SpringLabels as SpringLabels,
    known as known,
    read_codec as read_codec,
    write_codec as write_codec,
)
from .indices import (
    COVERING_RADIUS as COVERING_RADIUS,
    INDICES as INDICES,
    STATISTICS as STATISTICS,
    Correlation as Correlation,
    IndexValues as IndexValues,
    correlate as correlate,
    index_values as index_values,
    write_index_table as write_index_table,
)
from .pairs import (
    DifferenceAtSize as DifferenceAtSize,
    PairedDifference as PairedDifference,
    PairVerdict as PairVerdict,
    compare_variants as compare_variants,
)
from .saturation import (
    Saturation as Saturation,
    SaturationInterval as SaturationInterval,
    Tolerance as Tolerance,
    find_saturation as find_saturation,
    median_draws as median_draws,
)
from .splits import (
    Campaign as Campaign,
    CodecOptions as CodecOptions,
    Split as Split,
    drawn_poses as drawn_poses,
    make_campaign as make_campaign,
    make_splits as make_splits,
    split_sizes as split_sizes,
)
from .variants import (
    ALL_LOADS as ALL_LOADS,
    KEYS as KEYS,
    SOLVERS as SOLVERS,
    Variant as Variant,
    check_different as check_different,
    make_variants as make_variants,
    read_comparison as read_comparison,
    read_comparisons as read_comparisons,
    training_cases as training_cases,
    values_by_key as values_by_key,
)
from .verdicts import (
    VERDICTS as VERDICTS,
    VERDICTS_SCHEMA as VERDICTS_SCHEMA,
    CodecSetup as CodecSetup,
    CodecSummary as CodecSummary,
    Curve as Curve,
    Verdicts as Verdicts,
    codec_summary as codec_summary,
    judge as judge,
    read_codec_folder as read_codec_folder,
    read_codec_summary as read_codec_summary,
    write_codec_summary as write_codec_summary,
)
