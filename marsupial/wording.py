"""Texts for people: times, numbers of things, suggestions for unknown names."""

import difflib
from collections.abc import Collection, Iterable

# Limits of the search for a similar word: its time grows with the square of the length, and the number of words.
_LONGEST_TYPED, _MOST_TYPOS, _MOST_OPTIONS = 30, 10, 60


def clock(seconds: float) -> str:
    """Return a time as ``1:02:03`` or ``2:03``, rounded to seconds, halves up, as in the page's ``text/format.js``."""
    minutes, rest = divmod(int(seconds + 0.5), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


def counted(number: int, noun: str) -> str:
    """Return a number of things, as ``1 mission`` or ``2 missions``."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def closest(word: str, options: Iterable[str]) -> str | None:
    """Return the one of `options` that `word` was probably meant to be, None if none is close."""
    near = [option for option in sorted(options) if abs(len(option) - len(word)) <= _MOST_TYPOS]
    if len(word) > _LONGEST_TYPED or len(near) > _MOST_OPTIONS:
        return None
    # as a plain text: names may be members of an enumeration
    return next((str(one) for one in difflib.get_close_matches(word.lower(), near, n=1)), None)


def suggestion(word: str, options: Iterable[str]) -> str:
    """Return ``, did you mean 'speed_mps'?`` where one of `options` is close to `word`, else nothing."""
    meant = closest(word, options)
    return "" if meant is None else f", did you mean {meant!r}?"


def unknown(what: str, word: str, options: Iterable[str]) -> str:
    """Return the message that `word` is none of `options`, with a suggestion."""
    return f"unknown {what} {word!r}{suggestion(word, options)}"


def unknown_name(what: str, word: str, options: Collection[str]) -> str:
    """Return the same with the list of options."""
    told = unknown(what, word, options)
    return f"{told}{' There' if told.endswith('?') else '; there'} are {', '.join(options)}"


def no_option(word: str, options: Iterable[str]) -> str:
    """Return the message that `word` is none of the few `options` of a field, with a suggestion if it has a choice."""
    words = list(options)
    return f"must be {' or '.join(words)}, got {word!r}{suggestion(word, words) if len(words) > 1 else ''}"
