"""Jobs in child processes that always end, together with all their descendants.

The *launcher* starts one *fork server*, a process that has imported the slow libraries and never has threads. It forks
a *supervisor* for each job, which forks the *worker* that runs the job, enforces its limits and ends the processes that
it leaves behind. Values travel both ways over one *channel* per job, between client and worker, through the supervisor.
"""
