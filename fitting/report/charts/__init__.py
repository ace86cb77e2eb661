"""Charts of a page as SVG and HTML: no script, colours of the style sheet, any width."""
