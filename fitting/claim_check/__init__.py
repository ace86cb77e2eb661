"""Whether a measurement holds to the claim of a fit, or to the certificate of a drive."""
