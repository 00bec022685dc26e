"""Exceptions and exit codes of commands."""

FAULTS, RUN_FAILED, USER_ERROR = 1, 1, 2


class UserError(Exception):
    """Something that the user can mend; the message says what, and what exists instead."""


class RunError(Exception):
    """A run that could not be finished, through nobody's mistake on the command line."""
