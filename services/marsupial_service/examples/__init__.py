"""Requests to try the service with, and those that the OpenAPI document shows."""
