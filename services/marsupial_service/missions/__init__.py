"""Missions with the clients' own robots: clients report what happens, the service plans and sends commands.

A mission is the closed loop of `marsupial.mission.loop` in a separate process, whose world is made of reports. The
store has its inputs (reports, pause, resume, cancel) and outputs (events) in order, and they are its whole state:
a process that died is replaced by one that replays them.
"""
