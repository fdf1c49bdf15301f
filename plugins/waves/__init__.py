"""Water surfaces: still water and wave models."""
