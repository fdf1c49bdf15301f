"""Animals that ship with SEALS: robots with gaits."""
