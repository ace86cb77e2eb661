"""How far the gap closes: cross-validation, bootstrap intervals, predicted gain."""
