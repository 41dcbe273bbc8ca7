import os
import subprocess
import sys
from pathlib import Path

from marsupial.generators.builtin import SCENARIOS
from marsupial.planning.engines import ENGINES
from marsupial.planning.names import OWN
from marsupial.strategies.clairvoyant import CLAIRVOYANT
from marsupial.strategies.registry import STRATEGIES

HEAVY = ("numba", "scipy", "matplotlib", "unified_planning", "skimage")

CODE = f"""
import os, sys
from marsupial.cli.main import main
for line in sys.argv[1:]:
    os.environ.update(_MARSUPIAL_COMPLETE="complete_bash", COMP_WORDS=line, COMP_CWORD=str(line.count(" ")))
    main()
    print("--", line, *(name for name in {HEAVY} if name in sys.modules))
"""

OFFERED = {
    "marsupial re": ["replay", "reproduce"],
    "marsupial serve keys ": ["add", "list", "revoke"],
    "marsupial run office --st": ["--strategy", "--steps"],
    "marsupial run ": [*SCENARIOS],
    "marsupial run ma": ["maze", "mall.yaml"],
    "marsupial map of": ["office"],
    "marsupial compare lobby ro": ["rooms"],
    "marsupial run office --strategy ": [*STRATEGIES, CLAIRVOYANT],
    "marsupial run office -s heur": ["heuristic", "heuristic-plus"],
    "marsupial compare lobby --strategies temporal,cl": ["temporal,closest-frontier", "temporal,clairvoyant"],
    "marsupial compare lobby --strategies temporal:gr": ["temporal:greedy"],
    "marsupial plan moment.json --planner ": sorted(ENGINES),
    "marsupial compare --suite foot": ["footprint", "footprint-tuning"],
    "marsupial reproduce wu": ["wurm2010", "wurm2008"],
    "marsupial replay ma": [],  # the shell completes files itself
}
"""Lines of a shell, and their completions."""


def test_the_shell_is_offered_what_fits_and_nothing_heavy_is_imported_for_it(tmp_path: Path) -> None:
    (tmp_path / "mall.yaml").touch()
    command = [sys.executable, "-c", CODE, *OFFERED]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path)
    expected = [told for line, names in OFFERED.items() for told in (*names, f"-- {line}")]
    assert [told for told in done.stdout.splitlines() if told] == expected


def test_the_names_of_engines_are_those_of_the_registry() -> None:
    assert tuple(sorted(ENGINES)) == OWN


def test_the_help_of_options_that_zsh_shows_is_whole(tmp_path: Path) -> None:
    told = {"_MARSUPIAL_COMPLETE": "complete_zsh", "_TYPER_COMPLETE_ARGS": "marsupial run office --st"}
    command = [sys.executable, "-m", "marsupial"]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env={**os.environ, **told})
    assert '"--strategy":"temporal, wurm2010, heuristic' in done.stdout
