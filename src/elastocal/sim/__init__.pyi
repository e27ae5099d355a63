from .driver import (
    DRIVER as DRIVER,
)
from .truth import (
    PRESET_FIGURES as PRESET_FIGURES,
    PRESETS as PRESETS,
    truth_of as truth_of,
)
