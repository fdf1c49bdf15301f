"""A giant sea spider on eight legs."""
