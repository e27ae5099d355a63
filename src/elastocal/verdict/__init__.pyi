from ._files import (
    BYTES as BYTES,
)
from .chain import (
    Link as Link,
    LinkState as LinkState,
)
from .evidence import (
    Evidence as Evidence,
    ModelEvidence as ModelEvidence,
)
from .findings import (
    find_everything as find_everything,
    has_own_process as has_own_process,
)
from .fitted import (
    FittedReadings as FittedReadings,
    fitted_readings as fitted_readings,
)
from .gather import EvidenceOptions as EvidenceOptions, gather_evidence as gather_evidence
from .history import (
    begin_record as begin_record,
)
from .judgement import (
    Light as Light,
    Verdict as Verdict,
    judge_evidence as judge_evidence,
)
from .manifest import (
    EMPTY_MANIFEST as EMPTY_MANIFEST,
    FoundManifest as FoundManifest,
    Manifest as Manifest,
    embed_manifest as embed_manifest,
    file_links as file_links,
    manifest_of as manifest_of,
    read_manifest as read_manifest,
)
from .poses_needed import PosesNeeded as PosesNeeded
from .signing import (
    OF_REPORT as OF_REPORT,
    OF_RUN as OF_RUN,
    Signature as Signature,
    check_signature as check_signature,
    make_key as make_key,
    public_key as public_key,
    read_private_key as read_private_key,
    read_public_key as read_public_key,
    sign as sign,
    write_signature as write_signature,
)
from .uncertainty import (
    UncertaintySource as UncertaintySource,
    UncertaintyStatement as UncertaintyStatement,
    state_uncertainty as state_uncertainty,
    why_not_stated as why_not_stated,
)
