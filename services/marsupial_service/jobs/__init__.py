"""Planning jobs that survive a server: stored before they are acknowledged, run in processes that always end."""
