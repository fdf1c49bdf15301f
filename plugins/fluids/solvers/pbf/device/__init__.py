"""Functions that run on the device: kernels grouped by model, data in, data out."""
