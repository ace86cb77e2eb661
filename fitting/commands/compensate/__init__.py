"""`rapi compensate`: its command, and the drives that it makes."""
