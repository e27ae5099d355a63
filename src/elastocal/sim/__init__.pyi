from .driver import (
    DRIVER as DRIVER,
)
from .truth import (
    PRESET_FIGURES as PRESET_FIGURES,
    PRESETS as PRESETS,
    truth_of as truth_of,
)
from .two_arms import (
    Tips as Tips,
    press_together as press_together,
    true_arm as true_arm,
)
