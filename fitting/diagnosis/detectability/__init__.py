"""How large an effect must have been for this recording to show it."""
