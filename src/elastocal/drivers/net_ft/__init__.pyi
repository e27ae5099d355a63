from .driver import (
    DRIVER as DRIVER,
    BoxLine as BoxLine,
    NetFtDriver as NetFtDriver,
    NetFtSettings as NetFtSettings,
)
from .protocol import (
    ASK_CALIBRATION as ASK_CALIBRATION,
    MOST_PAGE as MOST_PAGE,
    PAGE as PAGE,
    BoxConfiguration as BoxConfiguration,
    Command as Command,
    CountScale as CountScale,
    RdtRecord as RdtRecord,
    parse_calibration as parse_calibration,
    parse_configuration as parse_configuration,
    parse_records as parse_records,
    request as request,
    status_names as status_names,
    status_of as status_of,
)
from .sensor import NetFtSensor as NetFtSensor
