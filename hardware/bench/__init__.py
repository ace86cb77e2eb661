"""The instruments of a laboratory together: from a file to a measurement."""
