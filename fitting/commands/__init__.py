"""The commands of `rapi`, one file each. Nothing heavy is imported before a command runs."""
