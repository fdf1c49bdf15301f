"""Measured data of one vehicle: nominal model, samples, trajectory."""
