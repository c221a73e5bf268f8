"""The shape of the ground, as it is measured in flight: mapped, kept as a file, flown over."""
