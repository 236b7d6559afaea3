"""From touched or seen landmarks to where arms and cameras stand."""
