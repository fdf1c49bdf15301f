"""Arms of a study against each other, from the raw tables that every run wrote."""
