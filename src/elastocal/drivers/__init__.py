"""Drivers of real devices, one package a family; each exports its `DRIVER`.

A driver fulfils `elastocal.cell.Driver`, imports the cell and what is below it, and is found by its
name: that of its package here, or an entry point of the group ``elastocal.drivers`` elsewhere.
Everything here is verified against simulators and public layouts, not against hardware.
"""
