"""What holds for all tests."""

import signal

# A shell that starts the tests in the background has them ignore Ctrl-C, and so do the scripts that they start;
# some of them press it.
signal.signal(signal.SIGINT, signal.default_int_handler)
