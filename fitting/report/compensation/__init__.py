"""Report of drives that were made."""
