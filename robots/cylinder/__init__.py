"""An upright cylinder of 0.2 m diameter and 0.3 m height, half as dense as water."""
