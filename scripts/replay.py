#!/usr/bin/env python3
"""`mjwrap replay`."""

from _command import run

run("replay")
