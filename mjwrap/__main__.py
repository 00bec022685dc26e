"""`python -m mjwrap` is the command `mjwrap`."""

import sys

from mjwrap.cli import main

if __name__ == "__main__":
    sys.exit(main())
