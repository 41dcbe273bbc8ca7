"""The closed loop of a mission, and playback of its events.

Read `loop` first. It uses `belief` (what is believed of the world), `policies` with `replanning` and `recall` (when to
make a new plan, and to return before the time limit), `deciding` with `carryover` (how a plan is made), `executor`
(start actions), `patience` (wait or stall), `journal` (log the news) and `measures`. `placement` puts a team on its
starts. `state`, `playback` and `rebuild` work on the events of a mission afterwards.
"""
