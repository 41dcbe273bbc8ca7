"""Al-Khawaldah, Livatino, Lee: Frontier-based Exploration with Two Cooperating Mobile Robots."""
