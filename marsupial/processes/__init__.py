"""Jobs in child processes that always end, with everything they started.

The *launcher* starts one *fork server*, a process that has imported the slow libraries and never has threads. It forks
a *supervisor* for each job, which forks the *worker* that does it, keeps its limits and ends what it leaves. Values
travel both ways over one *channel* per job, from the asker through the supervisor to the worker.
"""
