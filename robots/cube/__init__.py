"""A cube of 5 cm and 0.1 kg that sinks."""
