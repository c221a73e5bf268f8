"""The emulated PX4 v1.18. Knows neither vehicles nor world: it is handed parameters and a channel."""
