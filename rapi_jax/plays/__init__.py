"""The play operator and its evaluations: by scan over samples, by contact intervals."""
