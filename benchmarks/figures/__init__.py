"""The figures of README and docs that come from missions, written from stored results of these missions.

``make figures`` rewrites every block between ``<!-- figures: NAME PART -->`` and ``<!-- end -->`` (`blocks`) from
the results and commit stored in ``rows/NAME`` (`kept`). ``make missions`` runs the missions first.
"""
