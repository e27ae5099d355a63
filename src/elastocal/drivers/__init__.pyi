from .registry import DRIVERS as DRIVERS
