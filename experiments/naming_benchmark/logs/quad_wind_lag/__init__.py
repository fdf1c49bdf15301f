"""Public log of `seals benchmark`: quad_wind_lag."""
