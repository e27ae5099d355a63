from .copies import check_plan as check_plan, file_sha256 as file_sha256, read_copies as read_copies
from .derivation import derive as derive, write_derived as write_derived
from .entries import Entry as Entry, Event as Event, RunRecord as RunRecord
from .itinerary import itinerary as itinerary
from .job import End as End, Job as Job, Result as Result, Seams as Seams
from .journal import Journal as Journal, commits as commits, read_journal as read_journal
from .plan_fit import check_fits as check_fits, registration_findings as registration_findings
from .pose_log import PoseLog as PoseLog
from .pose_recorder import SCHEMA as SCHEMA
from .progress import Progress as Progress
from .reduction import PoseReadings as PoseReadings, reduce_pose as reduce_pose
from .resume import (
    LastKnown as LastKnown,
    check_same_run as check_same_run,
    check_same_settings as check_same_settings,
    last_known as last_known,
    run_record as run_record,
)
from .run_folder import (
    JOURNAL as JOURNAL,
    RunFolder as RunFolder,
    cell_place as cell_place,
    fill as fill,
    make_folder as make_folder,
    refuse_foreign as refuse_foreign,
)
from .runner import Runner as Runner
from .settings import Settings as Settings, settings_of as settings_of
from .streams import PoseRecorder as PoseRecorder, read_streams as read_streams
from .summary import read_summary as read_summary
from .ways import way_home as way_home
