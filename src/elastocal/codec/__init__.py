"""CODEC: repeated cross-validation over growing training sets (paper 3.2, Algorithm 1)."""

from elastocal.codec.cross_validation import cross_validate
from elastocal.codec.data import CodecData, SpringLabels
from elastocal.codec.data_file import read_codec, write_codec
from elastocal.codec.options import CodecOptions
from elastocal.codec.pairs import Pair, paired
from elastocal.codec.saturation import Saturation, Tolerance, saturation
from elastocal.codec.splits import Split, make_splits, split_sizes
from elastocal.codec.training import AXES
from elastocal.codec.variants import KEYS, SOLVERS, Variant, make_variants, read_comparison
from elastocal.codec.verdict_file import read_verdicts, verdict_record, write_verdicts
from elastocal.codec.verdicts import Verdicts, judge

__all__ = [
    "AXES",
    "KEYS",
    "SOLVERS",
    "CodecData",
    "CodecOptions",
    "Pair",
    "Saturation",
    "Split",
    "SpringLabels",
    "Tolerance",
    "Variant",
    "Verdicts",
    "cross_validate",
    "judge",
    "make_splits",
    "make_variants",
    "paired",
    "read_codec",
    "read_comparison",
    "read_verdicts",
    "saturation",
    "split_sizes",
    "verdict_record",
    "write_codec",
    "write_verdicts",
]
