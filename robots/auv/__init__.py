"""An underwater vehicle with six thrusters, actuated in all degrees of freedom."""
