"""`rapi import`: its command, and which of its options go together."""
