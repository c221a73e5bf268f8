"""What aids the filter, a file for each sensor: when it is used, what it tells, and what happens when it disagrees."""
