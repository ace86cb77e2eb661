"""Where the jobs of a batch are done: in this process, or in workers."""
