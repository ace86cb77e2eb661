"""Tables, JSON and picture of a population."""
