"""A torpedo-shaped underwater vehicle of 30.5 kg with a propeller and four fins."""
