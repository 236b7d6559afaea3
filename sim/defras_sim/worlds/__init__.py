"""Worlds: something that takes motion commands and gives sensor readings."""
