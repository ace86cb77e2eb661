"""Effects that jump: the places of jumps are searched before a refit steps."""
