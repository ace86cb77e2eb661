"""What is in a recording, and what it allows to be asked, before any fit."""
