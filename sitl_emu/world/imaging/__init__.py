"""What a real image sensor makes of a drawn picture: settings, sources and limits stand in docs/cameras.md.

`imager.py` is the whole way of the light, `motion.py` where rows look, `exposure.py` time and gain, `pixels.py` the
passes over all pixels.
"""
