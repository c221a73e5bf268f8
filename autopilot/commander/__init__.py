"""Who may arm, which mode is flown, what a failure leads to."""
