"""Wurm et al.: Coordinated Exploration with Marsupial Teams of Robots using Temporal Symbolic Planning, IROS 2010."""
