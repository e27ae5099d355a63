from .driver import DRIVER as DRIVER, SimulatedDriver as SimulatedDriver
