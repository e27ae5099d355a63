from .order import SECTIONS as SECTIONS
