"""The certificate of an operator: proof that it inverts on a range of drive, or where it fails."""
