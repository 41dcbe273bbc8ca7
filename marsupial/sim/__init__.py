"""The simulator: a hidden world of robots (`world`), the rules that hold in it, and what robots see (`sensors`)."""
