"""A floating ball of 0.1 m diameter and 0.3 kg."""
