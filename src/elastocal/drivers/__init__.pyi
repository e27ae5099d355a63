from .device_clock import MOST_DRIFT as MOST_DRIFT, DeviceClock as DeviceClock
from .stations import (
    NEWEST as NEWEST,
    RECEIVED as RECEIVED,
    WAKE as WAKE,
    StationFeed as StationFeed,
    StationLink as StationLink,
    StationsMetrology as StationsMetrology,
    metrology_set as metrology_set,
    require_station as require_station,
    require_trackers as require_trackers,
)
