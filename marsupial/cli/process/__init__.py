"""The program as a process of the system: exit codes and signals."""
