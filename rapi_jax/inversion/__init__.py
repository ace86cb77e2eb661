"""The inverse of a model: certificate, exact inverse, compensation, learning control."""
