"""What an arm says when it does not do what it was told."""


class Refused(ValueError):
    """A command that the arm does not carry out; the message says why, for its error topic."""
