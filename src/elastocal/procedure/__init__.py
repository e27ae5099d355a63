"""Procedure 1 of the paper: run a plan on devices, keep everything, derive the dataset."""
