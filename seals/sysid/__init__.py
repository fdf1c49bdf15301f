"""System identification: name the physical effect that a model lacks, from measured logs."""
