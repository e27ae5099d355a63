from .device_clock import MOST_DRIFT as MOST_DRIFT, DeviceClock as DeviceClock
from .station_link import WAKE as WAKE, StationLink as StationLink, metrology_set as metrology_set
from .stations import (
    NEWEST as NEWEST,
    StationFeed as StationFeed,
    StationsMetrology as StationsMetrology,
    require_station as require_station,
    require_trackers as require_trackers,
)
