"""How many missions may be open at a time: in all, of one owner, and with robots that this service simulates."""

from dataclasses import dataclass

from marsupial_service.entries.records import TooMany
from marsupial_service.settings import ServiceLimits
from marsupial_service.store.transaction import StoreReader

# retry delay when too many missions are simulated: such a mission takes a minute or more
_SIMULATED_S = 10


@dataclass(frozen=True, slots=True)
class OpenMissions:
    """The numbers of open missions, of an owner's, and of the simulated ones among both."""

    all: int
    own: int
    simulated: int
    own_simulated: int

    def check(self, limits: ServiceLimits, *, simulated: bool) -> None:
        """Raise TooMany if the owner may not create another mission."""
        if self.all >= limits.missions:
            raise TooMany(f"the limit of {limits.missions} open missions is reached")
        if self.own >= limits.key_missions:
            raise TooMany(f"your limit of {limits.key_missions} open missions is reached")
        if simulated and self.free_simulations(limits) == 0:
            raise TooMany(f"the limit of {limits.simulations} simulated missions is reached", _SIMULATED_S)

    def free_simulations(self, limits: ServiceLimits) -> int:
        """Return how many simulated missions the owner may create now."""
        simulated = limits.simulations - self.simulated
        if not self.own_simulated:  # an owner's first is exempt: others' may run for hours
            simulated = max(simulated, 1)
        return max(0, min(limits.missions - self.all, limits.key_missions - self.own, simulated))


def open_missions(reader: StoreReader, owner: str) -> OpenMissions:
    """Count the open missions."""
    counted = ("0 = 0", "owner = ?", "simulation IS NOT NULL", "owner = ? AND simulation IS NOT NULL")
    counts = ", ".join(f"count(*) FILTER (WHERE {which})" for which in counted)
    row = reader.execute(f"SELECT {counts} FROM missions WHERE finished_ms IS NULL", (owner, owner)).fetchone()
    return OpenMissions(*row)
