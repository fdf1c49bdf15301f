"""Plug-ins that ship with SEALS, one folder per kind, found through entry points like any other."""
