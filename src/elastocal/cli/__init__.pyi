from .commands import COMMANDS as COMMANDS
from .generator import (
    Command as Command,
    Given as Given,
    on_a_terminal as on_a_terminal,
    plugged as plugged,
)
from .main import (
    run as run,
)
