"""Which of all variants in the codecs is the one that the calibration was made like."""

from elastocal.codec import ALL_LOADS, Saturation, Variant
from elastocal.report.document.parts import Parts


def leading(parts: Parts) -> Saturation | None:
    """Return the saturation of the variant like the calibration; else of the most accurate one.

    Parameters
    ----------
    parts : Parts
        With any number of codecs; without one there is no saturation.
    """
    found = [
        (variant, saturation)
        for codec in parts.codecs
        for variant, saturation in zip(codec.data.variants, codec.verdicts.saturation, strict=True)
    ]
    alike = [pair for pair in found if _is_like(pair[0], parts)]
    return min(
        (saturation for _, saturation in alike or found),
        key=lambda each: each.last_error,
        default=None,
    )


def _is_like(variant: Variant, parts: Parts) -> bool:
    """Return whether a variant has the springs, the loads and the search of the calibration."""
    settings = parts.calibrated.figures.get("settings") if parts.calibrated else None
    springs = (settings or {}).get("springs", "bearing")
    search = parts.plan.search.name if parts.plan is not None else variant.search
    return (variant.springs, variant.load_cases, variant.search) == (springs, ALL_LOADS, search)
