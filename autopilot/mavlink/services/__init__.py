"""Services: what the autopilot answers, one module per MAVLink microservice (https://mavlink.io/en/services/)."""
