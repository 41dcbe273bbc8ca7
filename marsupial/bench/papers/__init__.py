"""The experiments of papers, carried out again: what is simulated, and what is found of their statements."""
