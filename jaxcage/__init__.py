"""Differentiable dynamics of rolling-bearing cages."""
