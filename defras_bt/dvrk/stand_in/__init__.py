"""A stand-in for a da Vinci Research Kit: two PSMs and their cameras, over a real ROS 1 master.

It knows nothing of the executive and nothing of how it is commanded but CRTK. One process holds the
arms (100 Hz), another the patient and the cameras, so that a slow picture never holds up an arm.
"""
