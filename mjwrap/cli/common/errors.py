"""Exceptions and exit codes of commands."""

FAULTS, RUN_FAILED, USER_ERROR = 1, 1, 2


class UserError(Exception):
    """A mistake that the user can correct; the message says what is wrong and lists what exists instead."""


class RunError(Exception):
    """The run failed although its arguments were correct."""
