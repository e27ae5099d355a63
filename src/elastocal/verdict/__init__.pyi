from .evidence import Evidence as Evidence, MissingPart as MissingPart
from .gather import EvidenceOptions as EvidenceOptions, gather_evidence as gather_evidence
