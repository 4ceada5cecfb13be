"""Laplacians and linear solves."""
