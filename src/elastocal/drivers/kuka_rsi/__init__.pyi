from ._cycle import (
    Cycle as Cycle,
    Motion as Motion,
    Pace as Pace,
    Step as Step,
)
from .arm import (
    KukaArm as KukaArm,
)
from .commissioning import (
    AnswerRecorder as AnswerRecorder,
    CommissioningRecord as CommissioningRecord,
    DelayEstimate as DelayEstimate,
    Excitation as Excitation,
    chirp as chirp,
    estimate_delay as estimate_delay,
)
from .context import (
    CHOICES as CHOICES,
    PRECISION as PRECISION,
    ContextEntry as ContextEntry,
    ContextInput as ContextInput,
    ContextObject as ContextObject,
    ContextOutput as ContextOutput,
    ContextParameter as ContextParameter,
    RsiContext as RsiContext,
)
from .context_reader import (
    check_context as check_context,
    read_context as read_context,
)
from .controller_files import (
    FORMS as FORMS,
    LONGEST_NAME as LONGEST_NAME,
    PROGRAMS as PROGRAMS,
    SHEET as SHEET,
    ControllerSet as ControllerSet,
    check_controller_file as check_controller_file,
    controller_files as controller_files,
    write_controller_files as write_controller_files,
)
from .corrections import (
    CorrectedKuka as CorrectedKuka,
    CorrectionGuard as CorrectionGuard,
    CorrectionSource as CorrectionSource,
    PathCorrections as PathCorrections,
    as_millimetres as as_millimetres,
)
from .driver import (
    DRIVER as DRIVER,
    KukaRsiDriver as KukaRsiDriver,
    connect_arm as connect_arm,
)
from .ethernet_file import (
    MODES as MODES,
    ContextPort as ContextPort,
    EthernetChannel as EthernetChannel,
    EthernetFile as EthernetFile,
    check_ethernet_file as check_ethernet_file,
)
from .force_control import (
    SILENT as SILENT,
    ForceLaw as ForceLaw,
    ForceReader as ForceReader,
    overshoot as overshoot,
)
from .link import (
    Handler as Handler,
    LinkAddress as LinkAddress,
    RsiLink as RsiLink,
)
from .link_statistics import LinkCounts as LinkCounts, LinkStatistics as LinkStatistics
from .messages import (
    MOST_BYTES as MOST_BYTES,
    NO_CORRECTION as NO_CORRECTION,
    Answerer as Answerer,
    Arrival as Arrival,
    IpocWatch as IpocWatch,
    MoveTarget as MoveTarget,
    Order as Order,
    ProgramState as ProgramState,
    RobMessage as RobMessage,
    SenMessage as SenMessage,
    Six as Six,
    is_overture as is_overture,
    read_rob as read_rob,
    write_sen as write_sen,
)
from .motions import (
    ContactGuard as ContactGuard,
    Press as Press,
    approach as approach,
    free_move as free_move,
    hold as hold,
    play as play,
    release as release,
    require_force as require_force,
    retract as retract,
    take_back as take_back,
)
from .posture import (
    PostureReader as PostureReader,
)
from .settings import (
    CORRECTIONS as CORRECTIONS,
    CYCLES as CYCLES,
    FASTEST as FASTEST,
    HOLD_ON as HOLD_ON,
    LATE_DELAY as LATE_DELAY,
    Bounds as Bounds,
    RsiSettings as RsiSettings,
    bounds_of as bounds_of,
    require_pair as require_pair,
)
