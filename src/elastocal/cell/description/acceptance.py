"""What a calibration is judged by: the tolerances of the process."""

from elastocal.cell.description.quantities import PositiveLength
from elastocal.records import StrictModel


class Acceptance(StrictModel):
    """Limits that the report and the comparison of two calibrations hold their figures against."""

    tolerance: PositiveLength | None = None
    """Largest error of a predicted deflection at a pose that the fit has not seen, in m."""
    drift: PositiveLength | None = None
    """Largest change of a predicted deflection between two calibrations of the cell, in m."""
