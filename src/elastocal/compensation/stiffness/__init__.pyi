from .choose import Choice as Choice, Hold as Hold, choose as choose
from .directional import (
    Directional as Directional,
    Ellipsoid as Ellipsoid,
    directional as directional,
    ellipsoid as ellipsoid,
)
from .permits import (
    Permit as Permit,
    cell_permit as cell_permit,
    same_robot as same_robot,
    within_limits as within_limits,
)
from .stations import Stations as Stations, read_stations as read_stations
from .survey import Grid as Grid, Survey as Survey, survey as survey
from .tables import write_choice as write_choice, write_survey as write_survey
