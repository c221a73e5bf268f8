"""The logger: topics become a ULog, in a file and over MAVLink (PX4: src/modules/logger)."""
