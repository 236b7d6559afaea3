"""The simulated side: everything that predicts or imitates the physical world."""
