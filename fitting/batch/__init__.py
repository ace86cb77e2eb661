"""Many recordings: each computed once, resumable, here or in workers."""

from ._record import JobRecord as JobRecord
