"""Public log of `seals benchmark`: auv_calm."""
