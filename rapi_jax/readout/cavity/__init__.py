"""The Fabry-Perot cavity: its peaks, their comb as a frequency scale, low-finesse fringes."""
