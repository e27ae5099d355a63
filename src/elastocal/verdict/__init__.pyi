from ._files import BYTES as BYTES, CONTENT as CONTENT, content_hash as content_hash
from ._finding import Finding as Finding
from .chain import (
    ChainFiles as ChainFiles,
    Link as Link,
    LinkState as LinkState,
    verify_chain as verify_chain,
)
from .evidence import (
    AcceptanceLimits as AcceptanceLimits,
    CodecEvidence as CodecEvidence,
    Evidence as Evidence,
    MissingPart as MissingPart,
    ModelEvidence as ModelEvidence,
    Seal as Seal,
    UsedFile as UsedFile,
    check_codec as check_codec,
    check_model as check_model,
    check_process as check_process,
    check_tool as check_tool,
    find_doubts as find_doubts,
)
from .findings import (
    FINDINGS as FINDINGS,
    codec_findings as codec_findings,
    compliance_findings as compliance_findings,
    find_everything as find_everything,
    has_own_process as has_own_process,
    instrument_findings as instrument_findings,
    missing_findings as missing_findings,
    place_of_reading as place_of_reading,
    process_findings as process_findings,
    reading_findings as reading_findings,
    recertification_findings as recertification_findings,
)
from .gather import EvidenceOptions as EvidenceOptions, gather_evidence as gather_evidence
from .history import (
    begin_record as begin_record,
    history_findings as history_findings,
    history_link as history_link,
)
from .judgement import (
    Light as Light,
    Verdict as Verdict,
    advise as advise,
    judge as judge,
    judge_evidence as judge_evidence,
)
from .manifest import (
    EMPTY_MANIFEST as EMPTY_MANIFEST,
    FoundManifest as FoundManifest,
    Manifest as Manifest,
    ManifestFile as ManifestFile,
    embed_manifest as embed_manifest,
    file_links as file_links,
    manifest_of as manifest_of,
    read_manifest as read_manifest,
)
from .signing import (
    OF_REPORT as OF_REPORT,
    OF_RUN as OF_RUN,
    Signature as Signature,
    check_signature as check_signature,
    make_key as make_key,
    public_key as public_key,
    read_private_key as read_private_key,
    read_public_key as read_public_key,
    read_signature as read_signature,
    sign as sign,
    write_signature as write_signature,
)
from .uncertainty import (
    COVERAGE_FACTOR as COVERAGE_FACTOR,
    UncertaintySource as UncertaintySource,
    UncertaintyStatement as UncertaintyStatement,
    state_uncertainty as state_uncertainty,
    why_not_stated as why_not_stated,
)
