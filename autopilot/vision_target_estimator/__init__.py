"""Where the target of a precision landing is."""
