from .commands import COMMANDS as COMMANDS
from .generator import Command as Command, Given as Given, plugged as plugged
from .main import (
    run as run,
)
