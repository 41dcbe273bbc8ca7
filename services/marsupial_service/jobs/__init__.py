"""Planning jobs that outlive the server: stored before they are acknowledged, run in processes that always end."""
