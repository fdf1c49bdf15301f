"""A floating ship section of 46.8 kg in a flume."""
