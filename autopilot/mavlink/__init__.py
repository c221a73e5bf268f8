"""What passes on the autopilot's MAVLink links: links, streams out, services in."""
