"""The inverse of a model: certificate, exact inverse, compensation, streaming, learning control."""
