"""Missions with robots that are not ours: their clients report what happens, the service plans and tells what to do.

A mission is the closed loop of `marsupial.mission.loop` in a process of its own, whose world is made of reports. What
went in (reports, pause, resume, cancel) and what came out (events) is stored in that order, and makes up all of it:
a process that died is replaced by one that goes through the same again.
"""
