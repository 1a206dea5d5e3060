"""Constraint sets from the files of other programs. One file a format."""
