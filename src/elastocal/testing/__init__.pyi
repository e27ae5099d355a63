from .checks import CheckSuite as CheckSuite
from .commands import (
    CommandOutput as CommandOutput,
    CommandSuite as CommandSuite,
    run_command as run_command,
)
from .drivers import DriverSuite as DriverSuite
from .filters import FilterSuite as FilterSuite
from .layouts import LayoutSuite as LayoutSuite
from .losses import LossSuite as LossSuite
from .programs import ProgramSuite as ProgramSuite
from .searches import CriterionSuite as CriterionSuite, TechniqueSuite as TechniqueSuite
from .sections import SectionSuite as SectionSuite
from .springs import SpringSuite as SpringSuite
