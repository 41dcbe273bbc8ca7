"""The work of the larger commands: missions, comparisons, plans. Modules of `commands` only read arguments."""
