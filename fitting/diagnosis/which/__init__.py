"""Which effect causes the gap: candidates refitted on a base, evidence, probabilities."""
