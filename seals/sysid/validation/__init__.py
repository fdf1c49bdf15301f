"""Adding what a diagnosis found to a model, and verifying it on logs that no fit saw."""
