"""An arm of a dVRK as its client sees it (CRTK, the Collaborative Robotics Toolkit)."""
