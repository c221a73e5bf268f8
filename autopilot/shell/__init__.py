"""The MAVLink shell: PX4's console over SERIAL_CONTROL (PX4: mavlink_shell.cpp and the POSIX pxh.cpp)."""
