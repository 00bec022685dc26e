#!/usr/bin/env python3
"""`mjwrap inspect`."""

from _command import run

run("inspect")
