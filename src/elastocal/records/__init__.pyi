from ._array_records import (
    Variable as Variable,
    array_fields as array_fields,
    arrays_of as arrays_of,
    read_netcdf as read_netcdf,
    variables_of as variables_of,
    write_netcdf as write_netcdf,
)
from ._codec import (
    SEAL as SEAL,
    from_data as from_data,
    json_sha256 as json_sha256,
    read_json as read_json,
    read_json_data as read_json_data,
    record as record,
    schema_of as schema_of,
    to_data as to_data,
    write_json as write_json,
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
