"""Simulated truth. Only the composition roots and the tests may import it."""
