"""The command line: verbs, tables and error messages of two lines."""
