"""What there is: terrain, objects, wind, light, the bodies of the vehicles and what their sensors measure."""
