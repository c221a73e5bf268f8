"""The ground side: the client half of the MAVLink services, plan files, telemetry logs.

Each service is a state machine on time that is handed to it: `on_message(now_us, msg)` and `on_time(now_us)` return the
messages to send (pymavlink messages of `sitl_emu.core.dialect`); retries and time limits live inside; `outcome` or
`done` tells the end. No socket, thread or clock in here. PX4's numbers stand as literals, so that both ends can't be
wrong together.
"""
