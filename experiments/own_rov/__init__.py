"""Recordings of an ROV as ArduSub writes them on board."""
