"""Modules that several commands use: arguments, recordings, output, figures, progress, exit codes."""
