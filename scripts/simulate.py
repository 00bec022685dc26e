#!/usr/bin/env python3
"""`mjwrap run`."""

from _command import run

run("run")
