"""How messages and tables put things into words."""


def counted(number: float, noun: str) -> str:
    """Return a number of things, such as "1 pose" and "2 poses"."""
    return f"{number:.0f} {noun}{'s' * (number != 1)}"
