"""How well a fit knows its parameters, and what follows for predictions, scans and distances."""
