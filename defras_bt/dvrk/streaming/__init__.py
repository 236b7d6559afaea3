"""From commands of 50 ms to set-points of 10 ms, with limits, and back from their echo."""
