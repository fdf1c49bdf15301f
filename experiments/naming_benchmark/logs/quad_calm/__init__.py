"""Public log of `seals benchmark`: quad_calm."""
