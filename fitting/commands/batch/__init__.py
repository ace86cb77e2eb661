"""`rapi batch`: its command, the jobs that it names, and its progress."""
