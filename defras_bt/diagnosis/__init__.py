"""What a simulation gets wrong: found in measured data, named, priced."""
