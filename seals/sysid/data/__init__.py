"""Measured data of one vehicle: stated model, samples, trajectory."""
