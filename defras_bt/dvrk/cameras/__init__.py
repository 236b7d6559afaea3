"""A laboratory's cameras: from the messages of their drivers to cloud and visibility."""
