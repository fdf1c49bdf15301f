"""The command line: verbs, tables and two-line refusals."""
