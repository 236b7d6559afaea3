"""What worlds raise when they cannot go on, or cannot begin."""


class WorldError(RuntimeError):
    """The world cannot take the next step; the message says when, where and why."""


class CannotImitate(ValueError):
    """The scene has something that this kind of world cannot imitate; the message names it."""
