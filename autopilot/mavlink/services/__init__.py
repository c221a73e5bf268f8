"""One file per MAVLink microservice, each a state machine on simulated time."""
