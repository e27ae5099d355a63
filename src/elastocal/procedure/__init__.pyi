from .derive.derivation import derive as derive, write_derived as write_derived
from .derive.readings import PoseReadings as PoseReadings, reduce_pose as reduce_pose
from .derive.summary import read_summary as read_summary
from .record.folder import (
    JOURNAL as JOURNAL,
    RunFolder as RunFolder,
    cell_place as cell_place,
    check_plan as check_plan,
    file_sha256 as file_sha256,
    fill as fill,
    make_folder as make_folder,
    read_copies as read_copies,
    refuse_foreign as refuse_foreign,
)
from .record.journal import (
    Entry as Entry,
    Event as Event,
    Journal as Journal,
    PoseLog as PoseLog,
    RunRecord as RunRecord,
    commits as commits,
    read_journal as read_journal,
)
from .record.streams import (
    STREAMS_SCHEMA as STREAMS_SCHEMA,
    PoseRecorder as PoseRecorder,
    read_streams as read_streams,
)
from .run.routes import itinerary as itinerary, way_home as way_home
from .run.runner import Runner as Runner
from .run.session import (
    End as End,
    Job as Job,
    LastKnown as LastKnown,
    Result as Result,
    Seams as Seams,
    check_same_run as check_same_run,
    check_same_settings as check_same_settings,
    last_known as last_known,
    run_record as run_record,
)
from .run.settings import (
    Settings as Settings,
    check_fits as check_fits,
    registration_findings as registration_findings,
    settings_of as settings_of,
)
from .run.steps import Progress as Progress
