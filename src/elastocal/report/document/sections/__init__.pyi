from . import (
    cell as cell,
    codecs as codecs,
    compliances as compliances,
    instruments as instruments,
    not_verified as not_verified,
    poses as poses,
    process as process,
    provenance as provenance,
    readings as readings,
    recertification as recertification,
)
