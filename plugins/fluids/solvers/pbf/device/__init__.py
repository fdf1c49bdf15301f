"""Device kernels of the fluid solver; docstrings name what each reads and writes."""
