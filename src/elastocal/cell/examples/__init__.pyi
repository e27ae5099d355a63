from .example import (
    BLOCK_SIZE as BLOCK_SIZE,
    EXAMPLES as EXAMPLES,
    Example as Example,
    binary_stl as binary_stl,
    block as block,
    check_like as check_like,
    dome_section as dome_section,
    write_example as write_example,
)
