"""Datasets: the labelled arrays of the paper's Procedure 1, and their files."""

from elastocal.dataset.dataset import Dataset
from elastocal.dataset.layout import SCHEMA, STATUSES
from elastocal.dataset.merging import merge
from elastocal.dataset.readings import Readings
from elastocal.dataset.store import read, write

__all__ = ["SCHEMA", "STATUSES", "Dataset", "Readings", "merge", "read", "write"]
