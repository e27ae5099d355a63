from .cell_edit import (
    CellEdit as CellEdit,
    CellForm as CellForm,
    CellText as CellText,
    LoadForm as LoadForm,
    RegionForm as RegionForm,
    StationForm as StationForm,
    form_of as form_of,
    region_around as region_around,
)
from .cell_text import (
    Key as Key,
    Value as Value,
    appended as appended,
    count_items as count_items,
    flow as flow,
    with_value as with_value,
    without as without,
)
from .posture import (
    CellView as CellView,
    CheckFigure as CheckFigure,
    JointFigure as JointFigure,
    PostureFigures as PostureFigures,
    SightFigure as SightFigure,
    joint_text as joint_text,
)
from .recorded import RunEntry as RunEntry, RunView as RunView, find_runs as find_runs
from .scene import (
    ARM as ARM,
    FIXTURE as FIXTURE,
    TOOL as TOOL,
    DrawnBody as DrawnBody,
    DrawnLine as DrawnLine,
    DrawnPlace as DrawnPlace,
    Scene as Scene,
    drawn_scene as drawn_scene,
)
from .server import (
    MOST_BYTES as MOST_BYTES,
    Action as Action,
    News as News,
    StudioServer as StudioServer,
)
from .session import (
    FolderMessage as FolderMessage,
    LineMessage as LineMessage,
    Nothing as Nothing,
    PlaceMessage as PlaceMessage,
    PlanMessage as PlanMessage,
    Posture as Posture,
    PostureMessage as PostureMessage,
    RunMessage as RunMessage,
    Session as Session,
    StudioWork as StudioWork,
)
from .springs import (
    CaseFigure as CaseFigure,
    StiffnessFigure as StiffnessFigure,
    StudioSprings as StudioSprings,
    calibrated_springs as calibrated_springs,
    default_springs as default_springs,
)
from .trials import compare_techniques as compare_techniques, survey_reach as survey_reach
from .worker import (
    Data as Data,
    Outbox as Outbox,
    Work as Work,
    Worker as Worker,
    WorkNews as WorkNews,
    WorkState as WorkState,
)
