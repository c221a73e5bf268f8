"""The ground everything stands on: ports, geodesy, MAVLink dialect, simulator API, channels, radio."""
