"""Which effects are worth a refit, by score statistics."""
