"""Behaviour-tree executive for soft-tissue retraction under anatomical uncertainty."""
