"""Motion of a target along the measurement arm, as functions of session time."""
