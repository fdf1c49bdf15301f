"""Many jobs by one command: what each of them notes, how they are watched and taken up again."""
