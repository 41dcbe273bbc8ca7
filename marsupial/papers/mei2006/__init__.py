"""Mei, Lu, Lee and Hu: Energy-Efficient Mobile Robot Exploration, ICRA 2006."""
