"""The JSON of requests and answers, as pydantic models: they check the shape, and the OpenAPI document is made of them.

What fields mean together is checked by the library's readers afterwards (`marsupial_service.intake`).
"""
