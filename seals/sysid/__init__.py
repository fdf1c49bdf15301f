"""Names the physical effect that a model lacks, from a measured log."""
