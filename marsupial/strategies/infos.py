"""Descriptions of marsupial's own strategies, for listings.

They are separate from the strategies' code, which takes a second to import.
"""

from marsupial.model.strategyinfo import StrategyInfo
from marsupial.strategies.clairvoyant import CLAIRVOYANT as CLAIRVOYANT_NAME

WITHOUT_ROVERS = "carriers without rovers"
ONE_ROBOT = "one carrier without rovers"

WURM_2010 = "Wurm et al. 2010, Coordinated Exploration with Marsupial Teams of Robots using Temporal Symbolic Planning"
WURM_2008 = "Wurm et al. 2008, Coordinated Multi-Robot Exploration using a Segmentation of the Environment"
BURGARD_2005 = "Burgard et al. 2005, Coordinated Multi-Robot Exploration"
AL_KHAWALDAH = "Al-Khawaldah et al., Frontier-based Exploration with Two Cooperating Mobile Robots"
SHENG_2006 = "Sheng et al. 2006, Distributed multi-robot coordination in area exploration"
MEI_2006 = "Mei et al. 2006, Energy-Efficient Mobile Robot Exploration"
KOENIG_2003 = "Koenig et al. 2003, Performance bounds for planning in unknown terrain"

OWN = (
    StrategyInfo(
        name="temporal",
        summary="asks a planner for concurrent plans, for known and guessed targets",
        asks_planner=True,
        parameters={"guess": 1.0, "price": 1.0, "early": 1.0, "choice": 1.0},
        source=f"marsupial's own, after {WURM_2010}",
    ),
    StrategyInfo(
        name="wurm2010",
        summary="the paper's method: the planner's shortest plan for the known targets",
        asks_planner=True,
        source=WURM_2010,
    ),
    StrategyInfo(
        name="heuristic",
        summary="the paper's baseline: carriers by travel cost, rovers by rule",
        source=WURM_2010,
    ),
    StrategyInfo(
        name="heuristic-plus",
        summary="the baseline without its obvious weaknesses",
        source="marsupial's own, after Wurm et al. 2010",
    ),
    StrategyInfo(
        name="assignment",
        summary="one Hungarian assignment of carriers, rovers and transports to targets",
        source=f"marsupial's own, after {BURGARD_2005}",
    ),
    StrategyInfo(
        name="closest-frontier",
        summary="each robot to the closest frontier that no other robot has",
        team=WITHOUT_ROVERS,
        source=f"the baseline of {WURM_2008}",
    ),
    StrategyInfo(
        name="segmentation",
        summary="each robot to a room or corridor of its own",
        team=WITHOUT_ROVERS,
        parameters={"discount": 0.5},
        source=WURM_2008,
    ),
    StrategyInfo(
        name="bidding",
        summary="each robot bids for frontier cells at every step",
        team=WITHOUT_ROVERS,
        parameters={"W_n": 2.0, "W_p": 2.0, "W_c": 1.0},
        source=AL_KHAWALDAH,
    ),
    StrategyInfo(
        name="sheng",
        summary="as bidding, with another bid: what would be seen, less the distance",
        team=WITHOUT_ROVERS,
        parameters={"w_1": 1.0, "w_2": 1.0},
        source=SHENG_2006,
    ),
    StrategyInfo(
        name="orientation",
        summary="frontiers to the robot's left first",
        team=ONE_ROBOT,
        parameters={"share": 0.7},
        source=MEI_2006,
    ),
    StrategyInfo(
        name="widest-frontier",
        summary="the middle of the widest frontier",
        team=ONE_ROBOT,
        source=f"the baseline of {MEI_2006}",
    ),
    StrategyInfo(
        name="covering",
        summary="tours on which the team sees everything, with the unknown taken as free",
        team=WITHOUT_ROVERS,
        parameters={"rounds": 4.0, "seconds": None},
        source=f"marsupial's own, after {KOENIG_2003}",
    ),
)

CLAIRVOYANT = StrategyInfo(
    name=CLAIRVOYANT_NAME,
    summary="knows the map before it starts: a practical bound for the others",
    source="marsupial's own",
)
