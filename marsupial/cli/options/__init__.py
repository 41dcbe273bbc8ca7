"""Options that several commands share, their completion by the shell, and help that is completed late."""
