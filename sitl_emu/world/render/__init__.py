"""What cameras see of any world: one geometry, a rasteriser and one shading pass, on the processor (README.md)."""
