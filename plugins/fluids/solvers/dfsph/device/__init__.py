"""Device kernels of divergence-free SPH; search, boundaries and bodies are those of PBF."""
