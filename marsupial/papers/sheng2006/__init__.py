"""Sheng, Yang, Tan, Xi: Distributed multi-robot coordination in area exploration, RAS 54(12), 2006."""
