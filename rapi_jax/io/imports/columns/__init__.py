"""Which columns of a file are time, drive and response: what is asked, and what cannot be."""
