"""Parameters of effects with standard errors, smooth ones and those that jump."""
