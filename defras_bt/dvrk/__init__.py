"""The da Vinci Research Kit: its contract (CRTK), streaming, checks, and a stand-in for it."""
