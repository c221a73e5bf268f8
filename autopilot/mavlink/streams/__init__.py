"""One file per outgoing message, named as the message."""
