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


def suggestion(word: str, options: Iterable[str]) -> str:
    """Return ``, did you mean 'speed_mps'?`` where one of `options` is close to `word`, else nothing."""
    near = [option for option in sorted(options) if abs(len(option) - len(word)) <= _MOST_TYPOS]
    if len(word) > _LONGEST_TYPED or len(near) > _MOST_OPTIONS:
        return ""
    close = difflib.get_close_matches(word.lower(), near, n=1)
    return f", did you mean {close[0]!r}?" if close else ""


def unknown_name(what: str, word: str, options: Collection[str]) -> str:
    """Return the message that `word` is none of `options`, with a suggestion and the list of options."""
    hint = suggestion(word, options)
    return f"unknown {what} {word!r}{hint}{' There' if hint else '; there'} are {', '.join(options)}"
