"""The JSON of requests and answers, as pydantic models, of which the OpenAPI document is made.

A request is validated here once: its shape, its bounds, and what becomes a value of the library at once. What needs
more than the field itself (the map, the limits, the names of others) is found wrong where the models are turned into
situations, map states, briefs and reports: `marsupial_service.intake` and `marsupial_service.intake.missions`.
"""
