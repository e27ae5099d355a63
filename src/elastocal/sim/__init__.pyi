from .driver import (
    DRIVER as DRIVER,
)
from .presets import (
    PRESET_FIGURES as PRESET_FIGURES,
    PRESETS as PRESETS,
)
from .truth import (
    truth_of as truth_of,
)
