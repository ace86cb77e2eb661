"""Page, terminal and files of a comparison of two recordings."""
