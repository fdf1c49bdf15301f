"""Public log of `seals benchmark`: auv_current."""
