"""Identification of the compliances: build, solve, certify (paper Eq. 15-19)."""
