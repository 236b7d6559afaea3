"""What a world raises when it cannot go on."""


class WorldError(RuntimeError):
    """The world cannot take the next step; the message says when, where and why."""
