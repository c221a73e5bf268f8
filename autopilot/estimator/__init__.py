"""From noisy sensors to attitude, velocity and position."""
