from .losses import LossSuite as LossSuite
from .searches import CriterionSuite as CriterionSuite, TechniqueSuite as TechniqueSuite
from .springs import SpringSuite as SpringSuite
