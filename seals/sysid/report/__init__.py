"""The report of a diagnosis: one page, one table, and the same as data."""
