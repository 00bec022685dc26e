"""The wording of messages and tables."""


def counted(number: float, noun: str) -> str:
    """Return a number of things, such as "1 pose" and "2 poses"."""
    return f"{number:.0f} {noun}{'s' * (number != 1)}"
