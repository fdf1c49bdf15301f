"""A Slocum glider of 70 kg, modelled for steady glides."""
