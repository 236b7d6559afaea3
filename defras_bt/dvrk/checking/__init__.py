"""What is looked at before a robot moves for the first time."""
