"""Run the command `mjwrap` by `python -m mjwrap`."""

import sys

from mjwrap.cli import main

if __name__ == "__main__":
    sys.exit(main())
