"""Strategies for robots that carry none, which send each robot to a frontier cell of the map."""
