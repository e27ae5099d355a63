from .assembly import SimulatedCell as SimulatedCell, simulated_devices as simulated_devices
from .clock import SimClock as SimClock
from .process import ProcessCell as ProcessCell
from .quick import Places as Places, QuickCell as QuickCell
from .quick_errors import ErrorDraws as ErrorDraws, QuickErrors as QuickErrors, Scales as Scales
