"""The commands, one file each: parse, call one workflow, print.

A new file here is a new command; `elastocal.cli.main` finds it.
"""
