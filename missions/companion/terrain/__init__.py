"""The shape of the ground, as a flight finds it: mapped, kept as a file, flown over."""
