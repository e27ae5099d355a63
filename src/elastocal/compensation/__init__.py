"""Compensation of the predicted deflection: online, offline, and on a real-time target."""
