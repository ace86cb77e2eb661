"""Effects whose mechanism is there in another form than their equation."""
