from .settings import CompensatorSettings as CompensatorSettings, read_settings as read_settings
