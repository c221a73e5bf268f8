"""Commands: which there are, who decides on each, and those that wait to be sent to others."""
