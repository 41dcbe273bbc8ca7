"""The command line: commands, progress and exit codes. What a command does is done by the layers below."""
