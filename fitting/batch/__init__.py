"""Many recordings: each computed once, here or in workers, and taken up again after any end."""
