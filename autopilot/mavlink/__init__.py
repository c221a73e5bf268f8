"""MAVLink endpoints: links, streams and services of PX4 v1.18."""
