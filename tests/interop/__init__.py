"""Real clients fly the emulator: MAVSDK, pymavlink, MAVProxy."""
