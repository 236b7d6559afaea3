"""What the engine can be asked about: a tissue, an arm, a specimen of material."""
