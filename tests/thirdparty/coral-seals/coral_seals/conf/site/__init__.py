"""Sites to dive at."""
