from .driver import (
    DRIVER as DRIVER,
    NetFtSettings as NetFtSettings,
)
