"""How messages of a dVRK come and go: ROS 1, ROS 2, or JSON over UDP."""
