from .driver import (
    DRIVER as DRIVER,
)
