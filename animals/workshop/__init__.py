"""What the animals' scripts share: drawn shells and limbs, and legs of three joints."""
