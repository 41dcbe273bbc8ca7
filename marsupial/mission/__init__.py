"""The closed loop of a mission, and playback of its events.

Read `loop` first. It uses `replanning` (when to make a new plan), `executor` (start actions), `carryover` (fit a plan
to a later moment), `recall` (return before the time limit), `patience` (wait or stall), and `steady` with `flicker`
(filter maps that change). `placement` puts a team on its starts. `state`, `playback`, `rebuild` and `frames` work on
the events of a mission afterwards.
"""
