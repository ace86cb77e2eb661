"""Reports of ranging: JSON and CSV for machines, lines and a page for people."""
