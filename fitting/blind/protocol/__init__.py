"""The protocol of the check: banks on disk, answers, commitments, tiers, sealed seeds."""
