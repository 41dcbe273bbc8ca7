"""Read a problem of the canonical domain as a situation.

::

    text ──parse_form──► forms ──_Reader──► FactTable ──assemble──► Situation
              brackets           names, numbers of     facts that agree
                                 arguments, types      with each other

Each step reports all its problems at once, with their lines. A problem written by hand may have no records: then the
situation is the simplest one with the same plans.
"""

from collections.abc import Iterator, Mapping, Sequence

from marsupial.errors import Problem, SituationError
from marsupial.formats.pddl.assemble import assemble
from marsupial.formats.pddl.domain import DOMAINS, LEAF_TYPES, PREDICATES, SUPERTYPES, WITH_BATTERIES, signatures
from marsupial.formats.pddl.facts import exact
from marsupial.formats.pddl.sexpr import Form, Word, at_line, conjuncts, parse_form, typed_list
from marsupial.formats.pddl.table import FactTable
from marsupial.model.situation import Situation

_SECTIONS = (":domain", ":objects", ":init", ":goal", ":metric", ":requirements")
_NEEDED_TYPES = ("robot_type", "carrier", "rover", "start", "target", "meeting")
# facts that a problem needs to have a plan
_NEEDED_FACTS = ("at", "is_a", "can_explore", "path", "path_cost", "capacity", "dock_time")
_MOST_NAMES = 6  # most names in a line


def read_problem(text: str) -> Situation:
    """Return the situation of a problem of the canonical domain; a `SituationError` has every problem with its line."""
    form = parse_form(text)
    if strange := _foreign(form):
        raise SituationError(strange)
    table = _Reader()
    table.read(form)
    table.check()
    return assemble(table)


class _Reader(FactTable):
    """Fills itself from the forms of a problem, and checks names, arguments and types."""

    def read(self, form: Form) -> None:
        """Read a whole ``(define (problem ...) ...)``."""
        sections = self._sections(form)
        for item in sections[":domain"].items[1:]:
            if str(item) not in DOMAINS:
                self.wrong(sections[":domain"].line, f"the domain must be marsupial, got {item}")
            else:
                self.domain = str(item)
        self._objects(sections[":objects"])
        for item in sections[":init"].items[1:]:
            self._initial(item)
        self._negations(sections[":init"])
        self._goal(sections[":goal"])

    def _sections(self, form: Form) -> Mapping[str, Form]:
        if form.head != "define" or len(form.items) < 2 or getattr(form.items[1], "head", "") != "problem":
            raise SituationError([at_line(form.line, "'(define (problem <name>) ...' is expected")])
        found: dict[str, Form] = {}
        for item in form.items[2:]:
            if not isinstance(item, Form) or item.head not in _SECTIONS:
                name = item.head if isinstance(item, Form) else item
                self.wrong(item.line, f"{name} is not a section of a problem")
            elif item.head in found:
                self.wrong(item.line, f"section {item.head} is there twice")
            else:
                found[item.head] = item
        for name in _SECTIONS[:4]:
            if name not in found:
                self.wrong(form.line, f"section {name} is missing")
                found[name] = Form((Word(name, form.line),), form.line)
        return found

    def _objects(self, section: Form) -> None:
        for word, kind in typed_list(section.items[1:]):
            if isinstance(word, Form):
                self.wrong(word.line, f"an object's name is expected, got {word}")
            elif str(kind) not in LEAF_TYPES or (str(kind) == "charging_place" and self.domain != WITH_BATTERIES):
                self.wrong(kind.line, f"{word}: type must be one of {', '.join(sorted(LEAF_TYPES))}, got {kind}")
            elif word.text in self.kinds:
                self.wrong(word.line, f"object {word} is declared twice")
            else:
                self.kinds[word.text] = str(kind)
                self.lines[word.text] = word.line

    def _initial(self, item: Word | Form) -> None:
        if isinstance(item, Word):
            self.wrong(item.line, f"a fact in brackets is expected, got {item}")
        elif item.head == "=":
            self._value(item)
        elif item.head != "not" and (fact := self._fact(item)) is not None:
            self.facts.setdefault(fact, item.line)

    def _negations(self, section: Form) -> None:
        """Check the facts that are said to be false, as all are that are not given: none of them is given too."""
        for item in section.items[1:]:
            if not isinstance(item, Form) or item.head != "not":
                continue
            if len(item.items) != 2 or not isinstance(item.items[1], Form):
                self.wrong(item.line, f"'(not (<predicate> ...))' is expected, got {item}")
            elif (fact := self._fact(item.items[1])) is not None and fact in self.facts:
                self.wrong(item.line, f"{item} contradicts line {self.facts[fact]}, where it is a fact")

    def _fact(self, item: Form) -> tuple[str, ...] | None:
        """Return a predicate with its arguments; None, with the problem noted, if it is unknown or they are wrong."""
        args = self._atom(item, signatures(self.domain, ":predicates"), "predicate")
        return None if args is None else (item.head, *args)

    def _value(self, item: Form) -> None:
        if len(item.items) != 3 or not isinstance(item.items[1], Form):
            self.wrong(item.line, f"'(= (<function> ...) <number>)' is expected, got {item}")
            return
        args = self._atom(item.items[1], signatures(self.domain, ":functions"), "function")
        if args is None:
            return
        key = (item.items[1].head, *args)
        if key in self.values:
            self.wrong(item.line, f"{item.items[1]} has a value already")
            return
        try:
            self.values[key] = exact(str(item.items[2])), item.line
        except ValueError:
            self.wrong(item.line, f"{item.items[1]}: a number is expected, got {item.items[2]}")

    def _atom(self, item: Form, known: Mapping[str, tuple[str, ...]], noun: str) -> tuple[str, ...] | None:
        signature = known.get(item.head)
        if signature is None:
            self.wrong(item.line, f"unknown {noun} {item.head or item}")
            return None
        args = tuple(str(arg) for arg in item.items[1:])
        if len(args) != len(signature):
            self.wrong(item.line, f"{item.head} takes {len(signature)} arguments, got {len(args)}: {item}")
            return None
        faults = [self._argument(item, arg, kind) for arg, kind in zip(args, signature, strict=True)]
        return None if any(faults) else args

    def _argument(self, item: Form, arg: str, wanted: str) -> bool:
        """Return whether an argument is unknown or of another type than `wanted`, and note the problem."""
        kind: str | None = self.kinds.get(arg)
        if kind is None:
            self.wrong(item.line, f"{item}: there is no object {arg}")
            return True
        while kind is not None and kind != wanted:
            kind = SUPERTYPES[kind]
        if kind is None:
            self.wrong(item.line, f"{item}: {arg} is a {self.kinds[arg]}, not a {wanted}")
        return kind is None

    def _goal(self, section: Form) -> None:
        self.goal_line = section.line
        if len(section.items) > 2:
            self.wrong(section.line, "a goal is one form: (and ...)")
        for whole in section.items[1:2]:
            for item in conjuncts(whole):
                if isinstance(item, Word) or item.head not in ("explored", "aboard", "at"):
                    self.wrong(item.line, f"a goal is explored, aboard or at, got {item}")
                    continue
                args = self._atom(item, PREDICATES, "predicate")
                if args is not None:
                    self.goals[(item.head, *args)] = item.line


def _foreign(form: Form) -> tuple[Problem, ...]:
    """Return three problems with what a problem of another domain lacks, not a thousand; none for one of ours.

    It is foreign if most of its types, facts and goals are unknown to the canonical domain, whatever the domain's name.
    """
    sections = [item for item in form.items if isinstance(item, Form)]
    objects = [item for section in sections if section.head == ":objects" for item in typed_list(section.items[1:])]
    kinds = [(f"type {kind}", item) for item, kind in objects]
    facts = [(item.head, item) for item in _facts(sections)]
    known = {f"type {kind}" for kind in LEAF_TYPES}
    for head in (":predicates", ":functions"):
        known |= signatures(WITH_BATTERIES, head).keys()  # it has all that the other domains have
    # Names count once, however often they are used: one unknown fact in a thousand places is one slip.
    used = {name for name, _ in (*kinds, *facts)}
    if len(used - known) <= len(used & known):
        return ()
    strange = [(name, item) for name, item in (*kinds, *facts) if name not in known]
    no_types = [kind for kind in _NEEDED_TYPES if f"type {kind}" not in used]
    no_facts = [fact for fact in _NEEDED_FACTS if fact not in used]
    domain = next((item for item in sections if item.head == ":domain"), form)
    return (
        at_line(domain.line, f"not a problem of marsupial's own domain, as `marsupial export` writes it, but {domain}"),
        Problem("", f"missing: objects of the types {listed(no_types)}; facts {listed(no_facts)}"),
        at_line(strange[0][1].line, f"{len(strange)} objects and facts mean nothing here, the first: {strange[0][1]}"),
    )


def _facts(sections: Sequence[Form]) -> Iterator[Form]:
    """Yield the facts and goals; for a numeric fact, its function."""
    for section in sections:
        parts = section.items[1:] if section.head in (":init", ":goal") else ()
        for part in (one for each in parts for one in conjuncts(each)):
            inner = part.items[1:] if isinstance(part, Form) and part.head in ("not", "=") else (part,)
            yield from (item for item in inner if isinstance(item, Form) and item.head)


def listed(names: Sequence[str]) -> str:
    """Return names as a text, without those after the first few."""
    more = f" and {len(names) - _MOST_NAMES} more" if len(names) > _MOST_NAMES else ""
    return ", ".join(names[:_MOST_NAMES]) + more if names else "none"
