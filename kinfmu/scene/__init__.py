"""What pictures of a mechanism share, moving or printed: outlines of bodies, pins of joints, poses, colours."""
