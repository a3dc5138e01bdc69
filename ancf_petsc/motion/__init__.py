"""Moving a model through time: equations of motion, integrators, motions compiled as a whole."""
