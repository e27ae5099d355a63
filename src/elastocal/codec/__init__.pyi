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
    CodecData as CodecData,
    read_codec as read_codec,
    write_codec as write_codec,
)
from .indices import (
    INDICES as INDICES,
    Correlation as Correlation,
    IndexValues as IndexValues,
    write_index_table as write_index_table,
)
from .saturation import (
    Saturation as Saturation,
    Tolerance as Tolerance,
)
from .show import (
    comparison_sentences as comparison_sentences,
    enough_sentence as enough_sentence,
    error_table as error_table,
    saturation_table as saturation_table,
    show_codec as show_codec,
    split_facts as split_facts,
)
from .splits import (
    CodecOptions as CodecOptions,
)
from .variants import (
    ALL_LOADS as ALL_LOADS,
    Variant as Variant,
    make_variants as make_variants,
    read_comparisons as read_comparisons,
    training_cases as training_cases,
)
from .verdicts import (
    VERDICTS as VERDICTS,
    VERDICTS_SCHEMA as VERDICTS_SCHEMA,
    CodecSummary as CodecSummary,
    Verdicts as Verdicts,
    codec_summary as codec_summary,
    judge as judge,
    read_codec_folder as read_codec_folder,
    read_codec_summary as read_codec_summary,
    write_codec_summary as write_codec_summary,
)
