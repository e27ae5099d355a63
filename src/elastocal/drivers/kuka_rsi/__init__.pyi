from .arm import (
    KukaArm as KukaArm,
)
from .commissioning import (
    CommissioningRecord as CommissioningRecord,
    DelayEstimate as DelayEstimate,
    chirp as chirp,
    estimate_delay as estimate_delay,
)
from .controller_files import (
    SHEET as SHEET,
    check_controller_file as check_controller_file,
    controller_files as controller_files,
    write_controller_files as write_controller_files,
)
from .driver import (
    DRIVER as DRIVER,
)
from .posture import (
    PostureReader as PostureReader,
)
from .settings import (
    Bounds as Bounds,
    RsiSettings as RsiSettings,
    bounds_of as bounds_of,
)
