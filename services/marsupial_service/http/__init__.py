"""The HTTP edge: what every request passes through, errors as problems, answers, events, the OpenAPI document."""
