"""An underwater vehicle with six thrusters that push and turn it in every direction."""
