"""What a user can do something about: bad input, a port in use, a folder that can't be written."""


class Trouble(Exception):
    """The text is one line for people: what is wrong, and what is allowed or what to do."""
