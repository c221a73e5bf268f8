"""The roof: scenario files, launcher, lockstep, report, command line."""
