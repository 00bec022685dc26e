"""What several commands share: arguments, models, output, progress, exit codes."""
