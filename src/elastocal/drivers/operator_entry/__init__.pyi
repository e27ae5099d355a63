from .entry import (
    DRIVER as DRIVER,
)
