"""What sensors share: mounting, noise, late and lost readings, and what they may look at."""
