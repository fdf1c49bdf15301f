"""Public log of `seals benchmark`: auv_drag."""
