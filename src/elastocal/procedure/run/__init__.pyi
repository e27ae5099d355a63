from .leaving import (
    ForceTap as ForceTap,
    LeavingWatch as LeavingWatch,
    ToolLoad as ToolLoad,
    leave_surface as leave_surface,
)
from .routes import (
    PlannedStep as PlannedStep,
    home_route as home_route,
    itinerary as itinerary,
    visits_in_rounds as visits_in_rounds,
)
from .runner import Runner as Runner
from .session import (
    LastKnown as LastKnown,
    RunEnd as RunEnd,
    Session as Session,
    SessionHooks as SessionHooks,
    SessionResult as SessionResult,
    check_same_run as check_same_run,
    check_same_settings as check_same_settings,
    last_known as last_known,
    run_record as run_record,
)
from .settings import (
    RunSettings as RunSettings,
    check_compatible as check_compatible,
    refusal_of_forces as refusal_of_forces,
    registration_warnings as registration_warnings,
    run_settings as run_settings,
)
from .steps import (
    FaultError as FaultError,
    Progress as Progress,
)
