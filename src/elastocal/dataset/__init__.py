"""Datasets: the labelled arrays of Procedure 1, and their files."""
