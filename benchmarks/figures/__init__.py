"""The figures of README and docs that come from missions, written from the kept results of these missions.

``make figures`` writes every block between ``<!-- figures: NAME PART -->`` and ``<!-- end -->`` anew (`blocks`), from
what is kept in ``rows/NAME`` with its commit (`kept`). ``make missions`` carries out the missions first.
"""
