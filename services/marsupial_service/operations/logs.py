"""Logs as JSON, one object a line, on stderr."""

from __future__ import annotations

import json
import logging
import sys

from marsupial_service.moments import timestamp

_OWN = frozenset(vars(logging.makeLogRecord({}))) | {"message", "asctime", "taskName", "color_message"}


class JsonLines(logging.Formatter):
    """A record as JSON: moment, level, logger, message, and whatever was given with it (``job``, ``status``)."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the line."""
        document = {
            "at": timestamp(int(1000 * record.created)),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
            **{key: value for key, value in vars(record).items() if key not in _OWN},
        }
        if record.exc_info:
            document["traceback"] = self.formatException(record.exc_info)
        return json.dumps(document, default=str)


def set_up(level: str) -> None:
    """Send all logs to stderr as JSON lines."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(JsonLines())
    logging.basicConfig(level=level.upper(), handlers=[handler], force=True)
