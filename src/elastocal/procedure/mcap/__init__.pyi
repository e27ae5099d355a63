from .reader import Contents as Contents, Messages as Messages, read_mcap as read_mcap
from .topic import TimeArray as TimeArray, Topic as Topic
from .writer import write_mcap as write_mcap
