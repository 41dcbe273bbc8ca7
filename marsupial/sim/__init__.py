"""The simulator: a hidden world in which robots drive, dock and see (`world`), and what they see (`sensors`)."""
