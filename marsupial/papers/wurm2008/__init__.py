"""Wurm, Stachniss, Burgard: Coordinated Multi-Robot Exploration using a Segmentation of the Environment, IROS 2008."""
