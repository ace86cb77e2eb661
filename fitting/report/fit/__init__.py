"""Tables, JSON and pictures of a fit."""
