"""The command line: commands, progress and exit codes. The layers below do the work."""
