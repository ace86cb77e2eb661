"""How results show themselves: summaries as text and HTML, tables for pandas and xarray."""
