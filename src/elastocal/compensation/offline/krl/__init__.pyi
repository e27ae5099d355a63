from .compensate import KrlResult as KrlResult, compensate_krl as compensate_krl
