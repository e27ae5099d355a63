from .writing import EXAMPLES as EXAMPLES, check_like as check_like, write_example as write_example
