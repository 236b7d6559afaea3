"""A specimen of material that is pulled along one axis."""
