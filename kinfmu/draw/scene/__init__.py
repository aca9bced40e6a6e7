"""The common base of figures, recordings and robot descriptions: outlines, pins, poses, joint shapes, colours."""
