"""A checked recording on a terminal."""
