#!/usr/bin/env python3
"""`mjwrap compare`."""

from _command import run

run("compare")
