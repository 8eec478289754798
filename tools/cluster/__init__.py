"""Blocks of a large scene on Ray."""
