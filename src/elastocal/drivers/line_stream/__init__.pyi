from .driver import (
    DRIVER as DRIVER,
    LineMetrology as LineMetrology,
    LineStreamDriver as LineStreamDriver,
    LineStreamSettings as LineStreamSettings,
    StationLine as StationLine,
)
from .lines import (
    LONGEST_LINE as LONGEST_LINE,
    AdapterFault as AdapterFault,
    BeamLine as BeamLine,
    Column as Column,
    Event as Event,
    FrameLine as FrameLine,
    LineReader as LineReader,
    MarkerPoint as MarkerPoint,
    columns_of as columns_of,
)
