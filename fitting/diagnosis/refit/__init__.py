"""Joint refits of an operator and effects to whitened errors."""
