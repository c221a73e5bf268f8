"""The checks before arming, one file each, as PX4's HealthAndArmingChecks/checks (v1.18).

Every check has a function `check(now_us, topics, settings, findings)` and writes what it found into `findings`.
"""
