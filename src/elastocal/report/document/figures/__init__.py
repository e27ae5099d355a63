"""Printed figures of the report that no other page has."""
