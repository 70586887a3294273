"""Solids of tetrahedra inside of any shape: meshes with defects, points, splats."""
