"""Public logs of `seals benchmark`, one folder each."""
