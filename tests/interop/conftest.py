"""The toy nodes of the executive's tests."""

from tests.executive.conftest import load_toys, toy_context, toys, write_tree

__all__ = ["load_toys", "toy_context", "toys", "write_tree"]
