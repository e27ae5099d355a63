from ._array_records import (
    Variable as Variable,
    array_fields as array_fields,
    arrays_of as arrays_of,
    read_netcdf as read_netcdf,
    variables_of as variables_of,
    write_netcdf as write_netcdf,
)
from ._codec import (
    from_data as from_data,
    read_json as read_json,
    read_json_data as read_json_data,
    record as record,
    schema_of as schema_of,
    sealed_data as sealed_data,
    to_data as to_data,
    write_json as write_json,
)
from ._json import (
    SEAL as SEAL,
    json_sha256 as json_sha256,
    parse_json as parse_json,
    require_written as require_written,
)
from ._netcdf import (
    LabelledArray as LabelledArray,
    LabelledArrays as LabelledArrays,
    arrays_sha256 as arrays_sha256,
    netcdf_image as netcdf_image,
    read_arrays as read_arrays,
    write_arrays as write_arrays,
)
from ._strict import (
    StrictModel as StrictModel,
    parse_yaml as parse_yaml,
    read_yaml as read_yaml,
    read_yaml_data as read_yaml_data,
)
from ._validation import check_schema as check_schema, validate as validate
