"""The strategies, which decide at each replanning what every robot does next.

`temporal` asks a planner, for known targets and those of `guess`. The others follow rules: `heuristic` is the paper's
baseline, `heuristic_plus` and `one_step` choose among the options of an `outlook`, and `frontier` has rules for teams
without rovers. `clairvoyant` knows the true map and serves as a bound. `registry` creates strategies by name.
"""
