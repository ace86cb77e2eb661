"""The diagnosis for people: page, terminal, JSON."""
