"""A Slocum glider of 70 kg, as far as a steady glide needs it."""
